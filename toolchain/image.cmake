# tetap_image(NAME target SOURCES main.cpp ... [BOARD name] [LIBRARIES tetap_node ...] [STACK bytes] [OUTPUT name] [DATA ddr|bytes] [OFFSET bytes] [ROBOT name])
# ROBOT: fills the image header (tools/run/seal_image), where the linker script keeps room for one.
# OFFSET: bytes at the begin of the flash that stay a boot loader's, where the board's link.ld has _flash_offset.
# makes NAME.elf .bin .hex .map in the binary directory, or OUTPUT.elf ... when another file name is wanted. Beside every object of
# the image lie its .su and .ci (stack use and call graph, GCC's VCG form): CMakeFiles/NAME.dir/.
# tetap_port(BOARD OUT): its folder of hal/board, whose link.ld says for which cores it is.
function(tetap_port board out)
  set(port "${board}")
  if(NOT EXISTS ${PROJECT_SOURCE_DIR}/hal/board/${port}/link.ld AND board MATCHES "^(.+)_(m7|m4f)$")
    set(port "${CMAKE_MATCH_1}")
    set(of_name "${CMAKE_MATCH_2}")
  endif()
  if(NOT board OR NOT EXISTS ${PROJECT_SOURCE_DIR}/hal/board/${port}/link.ld)
    message(FATAL_ERROR "TETAP_BOARD is '${board}': there is no hal/board/${port} with a link.ld (a preset of CMakePresets.json names the board)")
  endif()
  file(STRINGS ${PROJECT_SOURCE_DIR}/hal/board/${port}/link.ld cores REGEX "core: [a-z0-9 ]+" LIMIT_COUNT 1)
  string(REGEX REPLACE "^.*core: ([a-z0-9 ]+).*$" "\\1" cores "${cores}")
  separate_arguments(cores)
  if(NOT TETAP_CORE IN_LIST cores OR (of_name AND NOT of_name STREQUAL TETAP_CORE))
    list(JOIN cores ", " cores)
    message(FATAL_ERROR "TETAP_BOARD is '${board}', but TETAP_CORE is '${TETAP_CORE}': hal/board/${port}/link.ld is for core ${cores}")
  endif()
  set(${out} "${port}" PARENT_SCOPE)
endfunction()
if(NOT TETAP_BOARD)
  message(FATAL_ERROR "TETAP_BOARD is '': a preset of CMakePresets.json names the board")
endif()
list(GET TETAP_BOARD 0 TETAP_FIRST_BOARD)

# At the end of every link line, behind the libraries that call them.
set(CMAKE_CXX_STANDARD_LIBRARIES "-Wl,--start-group -lc -lgcc -Wl,--end-group")

function(tetap_image)
  cmake_parse_arguments(ARG "" "NAME;BOARD;STACK;OUTPUT;DATA;OFFSET;ROBOT" "SOURCES;LIBRARIES" ${ARGN})
  foreach(needed NAME SOURCES)
    if(NOT ARG_${needed})
      message(FATAL_ERROR "tetap_image: ${needed} is missing")
    endif()
  endforeach()
  if(ARG_UNPARSED_ARGUMENTS)
    message(FATAL_ERROR "tetap_image(${ARG_NAME}): what is '${ARG_UNPARSED_ARGUMENTS}'?")
  endif()
  if(NOT ARG_OUTPUT)
    set(ARG_OUTPUT ${ARG_NAME})
  endif()
  if(NOT ARG_BOARD)
    set(ARG_BOARD ${TETAP_FIRST_BOARD})
  endif()
  tetap_port("${ARG_BOARD}" folder)
  set(port ${PROJECT_SOURCE_DIR}/hal/board/${folder})
  set(script ${port}/link.ld)
  set(output ${CMAKE_CURRENT_BINARY_DIR}/${ARG_OUTPUT})

  add_executable(${ARG_NAME} ${ARG_SOURCES} ${port}/startup.cpp ${PROJECT_SOURCE_DIR}/hal/chip/support/runtime.cpp)
  if(TETAP_CORE STREQUAL "m4f")
    target_sources(${ARG_NAME} PRIVATE ${PROJECT_SOURCE_DIR}/hal/chip/support/double_sum.cpp)
    target_link_options(${ARG_NAME} PRIVATE
      -Wl,--wrap=__aeabi_dadd -Wl,--wrap=__aeabi_dsub -Wl,--wrap=__aeabi_drsub)
  endif()
  set_target_properties(${ARG_NAME} PROPERTIES OUTPUT_NAME ${ARG_OUTPUT} SUFFIX .elf LINK_DEPENDS "${script};${PROJECT_SOURCE_DIR}/hal/chip/stm32/sections.ld"
    RUNTIME_OUTPUT_DIRECTORY ${CMAKE_CURRENT_BINARY_DIR})
  target_include_directories(${ARG_NAME} PRIVATE ${PROJECT_SOURCE_DIR}/src ${PROJECT_SOURCE_DIR})
  target_compile_options(${ARG_NAME} PRIVATE -fstack-usage -fcallgraph-info=su)
  # A compiler cache keeps objects but not their call graphs.
  set_target_properties(${ARG_NAME} PROPERTIES CXX_COMPILER_LAUNCHER "")
  string(TOUPPER ${folder} board_macro)
  target_compile_definitions(${ARG_NAME} PRIVATE TETAP_BOARD_${board_macro})
  target_link_libraries(${ARG_NAME} PRIVATE tetap_flashed_flags ${ARG_LIBRARIES})
  # Of the C library only what the compiler itself calls (memcpy, memset, memmove, memcmp) can be linked: nothing supplies _sbrk, so
  # malloc fails to link, and libm is not there at all.
  target_link_options(${ARG_NAME} PRIVATE -nostdlib -nostartfiles -L ${PROJECT_SOURCE_DIR} -T ${script} -Wl,--gc-sections -Wl,--print-memory-usage
    -Wl,--fatal-warnings -Wl,-Map=${output}.map $<$<BOOL:${ARG_STACK}>:-Wl,--defsym=_stack_size=${ARG_STACK}>
    $<$<STREQUAL:${ARG_DATA},ddr>:-Wl,--defsym=_data_in_ddr=1> $<$<NOT:$<OR:$<STREQUAL:${ARG_DATA},>,$<STREQUAL:${ARG_DATA},ddr>>>:-Wl,--defsym=_data_size=${ARG_DATA}>
    $<$<BOOL:${ARG_OFFSET}>:-Wl,--defsym=_flash_offset=${ARG_OFFSET}>)
  set(seal "")
  if(ARG_ROBOT)
    set(seal COMMAND /usr/bin/python3 ${PROJECT_SOURCE_DIR}/tools/run/seal_image ${output}.elf --board ${folder} --robot ${ARG_ROBOT})
  endif()
  add_custom_command(TARGET ${ARG_NAME} POST_BUILD
    COMMAND ${CMAKE_OBJCOPY} -O binary ${output}.elf ${output}.bin
    ${seal}
    COMMAND ${CMAKE_OBJCOPY} -O ihex ${output}.elf ${output}.hex
    BYPRODUCTS ${output}.bin ${output}.hex ${output}.map)
endfunction()
