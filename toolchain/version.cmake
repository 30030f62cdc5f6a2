# Writes OUTPUT/version.hpp and version.cpp with the first 28 bits of the commit and a mark of a changed tree, only when they have changed: run at every build,
# rebuilds nothing by itself.
execute_process(COMMAND git -C ${SOURCE} rev-parse --short=8 HEAD OUTPUT_VARIABLE commit OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET
                RESULT_VARIABLE failed)
if(failed)
  set(commit 00000000)
endif()
string(SUBSTRING "${commit}" 0 7 commit)
execute_process(COMMAND git -C ${SOURCE} status --porcelain OUTPUT_VARIABLE changes ERROR_QUIET)
set(dirty 0)
if(changes)
  set(dirty 1)
endif()

function(write_if_other path text)
  set(old "")
  if(EXISTS ${path})
    file(READ ${path} old)
  endif()
  if(NOT text STREQUAL old)
    file(WRITE ${path} "${text}")
  endif()
endfunction()

# The mark is for tools/python/tetap/proof/stamps.py: programs that differ in the number behind it alone compute the same.
write_if_other(${OUTPUT}/version.hpp "// Generated.
#pragma once
#include \"tetap/bus/version.hpp\"
#include <cstdint>
namespace tetap {
struct Commit {
  char mark[12];
  std::uint32_t number;  ///< first 28 bits of the commit this was built from, 0 outside of a repository; then 4 bits, 1: changed since
};
extern const Commit kCommit;
inline bus::Version version() { return {.git = kCommit.number >> 4, .dirty = (kCommit.number & 15U) != 0}; }
}
")
write_if_other(${OUTPUT}/version.cpp "// Generated.
#include <cstdint>
namespace tetap {
struct Commit {
  char mark[12];
  std::uint32_t number;
};
extern const Commit kCommit;
const Commit kCommit{.mark = \"tetap-git:\", .number = 0x${commit}${dirty}};
}
")
