# Toolchain file of everything that is flashed. A preset names the core, TETAP_CORE: r5, m7 or m4f, and its boards, TETAP_BOARD: folders of
# hal/board, or one for several cores with _m7 or _m4f behind its name. What is no board's own is compiled once for all of them.
set(CMAKE_SYSTEM_NAME Generic)
set(CMAKE_SYSTEM_PROCESSOR arm)
set(CMAKE_C_COMPILER arm-none-eabi-gcc)
set(CMAKE_CXX_COMPILER arm-none-eabi-g++)
set(CMAKE_ASM_COMPILER arm-none-eabi-gcc)
set(CMAKE_OBJCOPY arm-none-eabi-objcopy)
set(CMAKE_SIZE arm-none-eabi-size)

set(TETAP_CORE "r5" CACHE STRING "r5, m7 or m4f")
set_property(CACHE TETAP_CORE PROPERTY STRINGS r5 m7 m4f)
# CMake's compiler checks are little projects of their own: no linker script there, and they must see the core too.
set(CMAKE_TRY_COMPILE_TARGET_TYPE STATIC_LIBRARY)
list(APPEND CMAKE_TRY_COMPILE_PLATFORM_VARIABLES TETAP_CORE)

if(TETAP_CORE STREQUAL "r5")
  # VFPv3-D16: no fused multiply-add.
  set(TETAP_CORE_FLAGS "-mcpu=cortex-r5 -mfpu=vfpv3-d16 -mfloat-abi=hard -mthumb")
elseif(TETAP_CORE STREQUAL "m7")
  set(TETAP_CORE_FLAGS "-mcpu=cortex-m7 -mfpu=fpv5-d16 -mfloat-abi=hard -mthumb")
elseif(TETAP_CORE STREQUAL "m4f")
  # Double precision is done in software (libgcc).
  set(TETAP_CORE_FLAGS "-mcpu=cortex-m4 -mfpu=fpv4-sp-d16 -mfloat-abi=hard -mthumb")
else()
  message(FATAL_ERROR "TETAP_CORE is '${TETAP_CORE}'; it must be r5, m7 or m4f")
endif()
set(TETAP_BOARD "" CACHE STRING "boards of hal/board; the first one runs the proofs of the core")
# The flags below are taken at the first configure only, so another core in an old folder would go by without a word.
if(DEFINED CACHE{TETAP_CONFIGURED_CORE} AND NOT TETAP_CONFIGURED_CORE STREQUAL TETAP_CORE)
  message(FATAL_ERROR "${CMAKE_BINARY_DIR} was configured for core ${TETAP_CONFIGURED_CORE}, the preset says ${TETAP_CORE}: remove that folder")
endif()
set(TETAP_CONFIGURED_CORE ${TETAP_CORE} CACHE INTERNAL "what the flags were made for")
foreach(language C CXX ASM)
  set(CMAKE_${language}_FLAGS_INIT "${TETAP_CORE_FLAGS}")
endforeach()

set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
