// SPDX-License-Identifier: Apache-2.0
// Preloaded into user-mode-linux 6.1 on processors with AMX (tools/run/provide_vcan does it). That keeps a process's
// vector registers in 2696 bytes, enough up to AVX-512, and hands them back through ptrace, of which Linux takes all
// that the host has or nothing: 11 kB with AMX, so the first process ended with "ptrace set fp regs failed, errno =
// 14". Here they are handed back in a buffer of the host's size. What is beyond theirs is AMX's, which nothing in the
// guest uses.
#include <dlfcn.h>
#include <sys/ptrace.h>
#include <sys/types.h>
#include <sys/uio.h>

#include <cerrno>
#include <cstring>

namespace {

constexpr long kVectorState = 0x202;  // NT_X86_XSTATE
using Ptrace = long (*)(int, pid_t, void*, void*);

/// Bytes of it that Linux asks for.
std::size_t host_size(Ptrace real, pid_t process) {
  static char room[1 << 16];
  iovec all{room, sizeof room};
  return real(PTRACE_GETREGSET, process, reinterpret_cast<void*>(kVectorState), &all) == 0 ? all.iov_len : 0;
}

}  // namespace

// The C library's own declaration has an ellipsis.
long ptrace_of_all(int request, pid_t process, void* address, void* data) noexcept __asm__("ptrace");
long ptrace_of_all(int request, pid_t process, void* address, void* data) noexcept {
  static const auto real = reinterpret_cast<Ptrace>(dlsym(RTLD_NEXT, "ptrace"));
  if (request != PTRACE_SETREGSET || reinterpret_cast<long>(address) != kVectorState)
    return real(request, process, address, data);
  static const std::size_t size = host_size(real, process);
  const auto& given = *static_cast<const iovec*>(data);
  static char whole[1 << 16];
  if (given.iov_len >= size) return real(request, process, address, data);
  std::memcpy(whole, given.iov_base, given.iov_len);
  iovec all{whole, size};
  return real(request, process, address, &all);
}
