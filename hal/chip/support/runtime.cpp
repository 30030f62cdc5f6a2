// SPDX-License-Identifier: Apache-2.0
// libgcc's division helpers refer to the unwinder, which would bring abort() and malloc() into the image. Nothing here
// unwinds.

// NOLINTBEGIN(bugprone-reserved-identifier): the run-time ABI makes these names
extern "C" {
void __aeabi_unwind_cpp_pr0();
void __aeabi_unwind_cpp_pr1();
void __aeabi_unwind_cpp_pr0() {}
void __aeabi_unwind_cpp_pr1() {}
}
// NOLINTEND(bugprone-reserved-identifier)
