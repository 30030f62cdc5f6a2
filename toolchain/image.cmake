# tetap_image(NAME target SOURCES main.cpp ... [LIBRARIES tetap_node ...] [STACK bytes] [OUTPUT name] [DATA ddr|bytes] [OFFSET bytes])
# OFFSET: bytes at the begin of the flash that stay a boot loader's, where the board's link.ld has _flash_offset.
# makes NAME.elf .bin .hex .map in the binary directory, or OUTPUT.elf ... when another file name is wanted. Beside every object of
# the image lie its .su and .ci (stack use and call graph, GCC's VCG form): CMakeFiles/NAME.dir/.
set(TETAP_PORT "${TETAP_BOARD}")
if(NOT EXISTS ${PROJECT_SOURCE_DIR}/hal/board/${TETAP_PORT}/link.ld AND TETAP_BOARD MATCHES "^(.+)_(m7|m4f)$")
  set(TETAP_PORT "${CMAKE_MATCH_1}")
  if(NOT CMAKE_MATCH_2 STREQUAL TETAP_CORE)
    message(FATAL_ERROR "TETAP_BOARD is '${TETAP_BOARD}', but TETAP_CORE is '${TETAP_CORE}'")
  endif()
endif()
if(NOT TETAP_BOARD OR NOT EXISTS ${PROJECT_SOURCE_DIR}/hal/board/${TETAP_PORT}/link.ld)
  message(FATAL_ERROR "TETAP_BOARD is '${TETAP_BOARD}': there is no hal/board/${TETAP_PORT} with a link.ld (a preset of CMakePresets.json names the board)")
endif()

# At the end of every link line, behind the libraries that call them.
set(CMAKE_CXX_STANDARD_LIBRARIES "-Wl,--start-group -lc -lgcc -Wl,--end-group")

function(tetap_image)
  cmake_parse_arguments(ARG "" "NAME;STACK;OUTPUT;DATA;OFFSET" "SOURCES;LIBRARIES" ${ARGN})
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
  set(port ${PROJECT_SOURCE_DIR}/hal/board)
  set(script ${port}/${TETAP_PORT}/link.ld)
  set(output ${CMAKE_CURRENT_BINARY_DIR}/${ARG_OUTPUT})

  add_executable(${ARG_NAME} ${ARG_SOURCES} ${port}/${TETAP_PORT}/startup.cpp ${PROJECT_SOURCE_DIR}/hal/chip/support/runtime.cpp)
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
  string(TOUPPER ${TETAP_PORT} board_macro)
  target_compile_definitions(${ARG_NAME} PRIVATE TETAP_BOARD_${board_macro})
  target_link_libraries(${ARG_NAME} PRIVATE tetap_flashed_flags ${ARG_LIBRARIES})
  # Of the C library only what the compiler itself calls (memcpy, memset, memmove, memcmp) can be linked: nothing supplies _sbrk, so
  # malloc fails to link, and libm is not there at all.
  target_link_options(${ARG_NAME} PRIVATE -nostdlib -nostartfiles -L ${PROJECT_SOURCE_DIR} -T ${script} -Wl,--gc-sections -Wl,--print-memory-usage
    -Wl,--fatal-warnings -Wl,-Map=${output}.map $<$<BOOL:${ARG_STACK}>:-Wl,--defsym=_stack_size=${ARG_STACK}>
    $<$<STREQUAL:${ARG_DATA},ddr>:-Wl,--defsym=_data_in_ddr=1> $<$<NOT:$<OR:$<STREQUAL:${ARG_DATA},>,$<STREQUAL:${ARG_DATA},ddr>>>:-Wl,--defsym=_data_size=${ARG_DATA}>
    $<$<BOOL:${ARG_OFFSET}>:-Wl,--defsym=_flash_offset=${ARG_OFFSET}>)
  add_custom_command(TARGET ${ARG_NAME} POST_BUILD
    COMMAND ${CMAKE_OBJCOPY} -O binary ${output}.elf ${output}.bin
    COMMAND ${CMAKE_OBJCOPY} -O ihex ${output}.elf ${output}.hex
    BYPRODUCTS ${output}.bin ${output}.hex ${output}.map)
endfunction()
