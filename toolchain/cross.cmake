# SPDX-License-Identifier: Apache-2.0
# Toolchain file of the machines that only `make bits` visits: Debian's clang, with the C and C++ libraries of TETAP_MACHINE. A preset names it.
set(TETAP_MACHINE "" CACHE STRING "wasm32-wasi, aarch64-linux-gnu or riscv64-linux-gnu")
list(APPEND CMAKE_TRY_COMPILE_PLATFORM_VARIABLES TETAP_MACHINE)
string(REGEX MATCH "^[a-z0-9]+" CMAKE_SYSTEM_PROCESSOR "${TETAP_MACHINE}")
foreach(language C CXX ASM)
  set(CMAKE_${language}_COMPILER_TARGET ${TETAP_MACHINE})
  set(CMAKE_${language}_COMPILER clang)
endforeach()
set(CMAKE_CXX_COMPILER clang++)

if(TETAP_MACHINE STREQUAL "wasm32-wasi")
  set(CMAKE_SYSTEM_NAME WASI)
  # GNU ar makes no index of WebAssembly's objects.
  set(CMAKE_AR llvm-ar-14 CACHE FILEPATH "")
  set(CMAKE_RANLIB llvm-ranlib-14 CACHE FILEPATH "")
  # Debian's libc++abi for WebAssembly has no exceptions.
  set(CMAKE_CXX_FLAGS_INIT "-fno-exceptions -fno-rtti")
elseif(TETAP_MACHINE MATCHES "^(aarch64|riscv64)-linux-gnu$")
  set(CMAKE_SYSTEM_NAME Linux)
  # A static program runs in qemu-user without a root of its own.
  set(CMAKE_EXE_LINKER_FLAGS_INIT "-static")
else()
  message(FATAL_ERROR "TETAP_MACHINE is '${TETAP_MACHINE}'; it must be wasm32-wasi, aarch64-linux-gnu or riscv64-linux-gnu")
endif()
# CMake knows no platform WASI and says so at length; whether the compiler works shows when `bits` is built.
set(CMAKE_TRY_COMPILE_TARGET_TYPE STATIC_LIBRARY)
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
