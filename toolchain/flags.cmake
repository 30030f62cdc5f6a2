# One list of flags for every build, host included: bit-identity is a property of these lines as much as of the sources.
set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)

# GCC's default for GNU C++ is -ffp-contract=fast, which would fuse a*b+c where the core has fma and nowhere else.
set(TETAP_FP_CONTRACT "off" CACHE STRING "off; anything else is for showing that `make bits` notices")
option(TETAP_EIGEN_VECTORIZE "for showing that `make bits` notices" OFF)

add_library(tetap_flags INTERFACE)
target_compile_options(tetap_flags INTERFACE
  -ffp-contract=${TETAP_FP_CONTRACT} -fno-fast-math -fno-math-errno -ffunction-sections -fdata-sections
  -Wall -Wextra -Wpedantic -Wconversion -Wshadow -Wdouble-promotion -Wfloat-equal -Wvla -Werror
  # Designated initialisers leave the rest to the defaults, on purpose.
  -Wno-missing-field-initializers)
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND "${CMAKE_CXX_FLAGS} ${CMAKE_CXX_FLAGS_RELEASE}" MATCHES "-march=|-mfma")
  # GCC 12 vectorises a*b -+ c*d, in a row and in loops, to vfmaddsub where the host has it, whatever -ffp-contract says; clang does not.
  target_compile_options(tetap_flags INTERFACE -fno-tree-vectorize)
endif()
target_compile_definitions(tetap_flags INTERFACE
  # Blocked products and triangular solves link malloc whatever the sizes; the threshold keeps products coefficient-wise.
  EIGEN_NO_MALLOC EIGEN_CACHEFRIENDLY_PRODUCT_THRESHOLD=64 EIGEN_MPL2_ONLY
  # Eigen's own checks call assert(); ranges are proved by the tests, and the image links no stdio.
  $<$<CONFIG:Release>:EIGEN_NO_DEBUG>)
if(NOT TETAP_EIGEN_VECTORIZE)
  # Vectorised sums run in another order than scalar ones.
  target_compile_definitions(tetap_flags INTERFACE EIGEN_DONT_VECTORIZE)
endif()

# What is flashed, on top: no exceptions, no RTTI, nothing that needs a C++ runtime.
add_library(tetap_flashed_flags INTERFACE)
target_compile_options(tetap_flashed_flags INTERFACE
  -fno-jump-tables  # a table is a jump that tools/proof/check_stack would have to guess the bounds of
  -fno-exceptions -fno-rtti -fno-threadsafe-statics -fno-use-cxa-atexit -fno-unwind-tables -fno-asynchronous-unwind-tables)
target_link_libraries(tetap_flashed_flags INTERFACE tetap_flags)

# Of a library that images link: flags of what is flashed, and the call graphs (.su, .ci) beside its objects that
# tools/proof/check_stack reads. A compiler cache keeps objects but not their call graphs.
function(tetap_call_graphs target)
  if(CMAKE_SYSTEM_NAME STREQUAL "Generic")
    target_compile_options(${target} PRIVATE -fstack-usage -fcallgraph-info=su)
    set_target_properties(${target} PROPERTIES CXX_COMPILER_LAUNCHER "")
    target_link_libraries(${target} PRIVATE tetap_flashed_flags)
  endif()
endfunction()
