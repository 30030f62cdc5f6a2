// SPDX-License-Identifier: Apache-2.0
// QEMU TCG plugin: counts the instructions that a guest executes inside named regions (test/count/markers.hpp), one
// line per execution, and on request finds the deepest address of the stack that is written.
// tools/proof/count_instructions builds it, writes its orders and reads its answers.
//
// -plugin region.so,orders=FILE,answers=FILE       orders, one a line, addresses in hexadecimal:
//   code FIRST END         only instructions in such a range are counted, so other cores of the machine do not disturb
//   region NAME BEGIN END  addresses of the two markers
//   pair ADDRESS           an instruction of two operations; all that are not named have one; in rising order
//   finish ADDRESS         executing this ends QEMU with status 0
//   stack BOTTOM TOP START watch stores to this range (slow) from the execution of START on, when the stack has been
//   painted
// answers: `region NAME INSTRUCTIONS PAIRS OPERATIONS` (PAIRS: other regions that began and ended inside), `stack
// LOWEST`, `error TEXT`, `finished`.
//
// Debian 12 ships no qemu-plugin.h; these are the prototypes needed, as in QEMU 7.2 "QEMU TCG Plugins", API version 1.
#include <inttypes.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

typedef uint64_t qemu_plugin_id_t;
typedef uint32_t qemu_plugin_meminfo_t;
typedef struct qemu_info_t qemu_info_t;
struct qemu_plugin_tb;
struct qemu_plugin_insn;
enum qemu_plugin_cb_flags { QEMU_PLUGIN_CB_NO_REGS, QEMU_PLUGIN_CB_R_REGS, QEMU_PLUGIN_CB_RW_REGS };
enum qemu_plugin_mem_rw { QEMU_PLUGIN_MEM_R = 1, QEMU_PLUGIN_MEM_W, QEMU_PLUGIN_MEM_RW };
enum qemu_plugin_op { QEMU_PLUGIN_INLINE_ADD_U64 };
typedef void (*TranslationCallback)(qemu_plugin_id_t, struct qemu_plugin_tb*);
typedef void (*ExecutionCallback)(unsigned, void*);
typedef void (*MemoryCallback)(unsigned, qemu_plugin_meminfo_t, uint64_t, void*);
typedef void (*ExitCallback)(qemu_plugin_id_t, void*);
void qemu_plugin_register_vcpu_tb_trans_cb(qemu_plugin_id_t, TranslationCallback);
void qemu_plugin_register_vcpu_insn_exec_cb(struct qemu_plugin_insn*, ExecutionCallback, enum qemu_plugin_cb_flags,
                                            void*);
void qemu_plugin_register_vcpu_insn_exec_inline(struct qemu_plugin_insn*, enum qemu_plugin_op, void*, uint64_t);
void qemu_plugin_register_vcpu_mem_cb(struct qemu_plugin_insn*, MemoryCallback, enum qemu_plugin_cb_flags,
                                      enum qemu_plugin_mem_rw, void*);
void qemu_plugin_register_atexit_cb(qemu_plugin_id_t, ExitCallback, void*);
size_t qemu_plugin_tb_n_insns(const struct qemu_plugin_tb*);
struct qemu_plugin_insn* qemu_plugin_tb_get_insn(const struct qemu_plugin_tb*, size_t);
uint64_t qemu_plugin_insn_vaddr(const struct qemu_plugin_insn*);

__attribute__((visibility("default"))) int qemu_plugin_version = 1;

enum { kRegions = 256, kRanges = 8, kNameLength = 63, kPairs = 1 << 16 };

struct Region {
  char name[kNameLength + 1];
  uint64_t begin, end;
  uint64_t count_at_begin, pairs_at_begin, operations_at_begin;
  bool active;
};
struct Range {
  uint64_t first, end;
};

static struct Region regions[kRegions];
static struct Range code[kRanges], stack;
static size_t region_count, code_count;
static uint64_t finish = UINT64_MAX, stack_start = UINT64_MAX, lowest = UINT64_MAX;
static uint64_t instructions, pairs, operations;
static uint64_t two_operations[kPairs];  // addresses, rising
static size_t two_operations_count;
static FILE* answers;

static void close_answers(bool finished) {
  if (answers == NULL) return;
  if (stack.end != 0) fprintf(answers, "stack %" PRIx64 "\n", lowest < stack.end ? lowest : stack.end);
  if (finished) fputs("finished\n", answers);
  fclose(answers);
  answers = NULL;
}

static void on_begin(unsigned cpu, void* data) {
  (void)cpu;
  struct Region* region = data;
  if (region->active && answers != NULL) fprintf(answers, "error %s begins twice without an end\n", region->name);
  region->active = true;
  region->pairs_at_begin = pairs;
  region->count_at_begin = instructions;
  region->operations_at_begin = operations;
}

static void on_end(unsigned cpu, void* data) {
  (void)cpu;
  struct Region* region = data;
  if (answers == NULL) return;
  if (!region->active) {
    fprintf(answers, "error %s ends without a begin\n", region->name);
    return;
  }
  region->active = false;
  fprintf(answers, "region %s %" PRIu64 " %" PRIu64 " %" PRIu64 "\n", region->name,
          instructions - region->count_at_begin, pairs - region->pairs_at_begin,
          operations - region->operations_at_begin);
  ++pairs;
}

static void on_finish(unsigned cpu, void* data) {
  (void)cpu;
  (void)data;
  for (size_t i = 0; i < region_count; ++i) {
    if (regions[i].active && answers != NULL) fprintf(answers, "error %s never ends\n", regions[i].name);
  }
  close_answers(true);
  _exit(0);  // other threads of QEMU still run, so nothing may be torn down
}

static void on_store(unsigned cpu, qemu_plugin_meminfo_t info, uint64_t address, void* data) {
  (void)cpu;
  (void)info;
  (void)data;
  if (address >= stack.first && address < stack.end && address < lowest) lowest = address;
}

static void on_stack_start(unsigned cpu, void* data) {
  (void)cpu;
  (void)data;
  lowest = UINT64_MAX;
}

static bool is_counted(uint64_t address) {
  for (size_t i = 0; i < code_count; ++i) {
    if (address >= code[i].first && address < code[i].end) return true;
  }
  return false;
}

static int compare(const void* a, const void* b) {
  const uint64_t left = *(const uint64_t*)a, right = *(const uint64_t*)b;
  return left < right ? -1 : left > right;
}

static bool has_two_operations(uint64_t address) {
  return bsearch(&address, two_operations, two_operations_count, sizeof address, compare) != NULL;
}

static void translate(qemu_plugin_id_t id, struct qemu_plugin_tb* block) {
  (void)id;
  for (size_t i = 0; i < qemu_plugin_tb_n_insns(block); ++i) {
    struct qemu_plugin_insn* instruction = qemu_plugin_tb_get_insn(block, i);
    const uint64_t address = qemu_plugin_insn_vaddr(instruction);
    if (!is_counted(address)) continue;
    for (size_t r = 0; r < region_count; ++r) {
      if (address == regions[r].begin)
        qemu_plugin_register_vcpu_insn_exec_cb(instruction, on_begin, QEMU_PLUGIN_CB_NO_REGS, &regions[r]);
      if (address == regions[r].end)
        qemu_plugin_register_vcpu_insn_exec_cb(instruction, on_end, QEMU_PLUGIN_CB_NO_REGS, &regions[r]);
    }
    if (address == finish) qemu_plugin_register_vcpu_insn_exec_cb(instruction, on_finish, QEMU_PLUGIN_CB_NO_REGS, NULL);
    if (address == stack_start)
      qemu_plugin_register_vcpu_insn_exec_cb(instruction, on_stack_start, QEMU_PLUGIN_CB_NO_REGS, NULL);
    if (stack.end != 0)
      qemu_plugin_register_vcpu_mem_cb(instruction, on_store, QEMU_PLUGIN_CB_NO_REGS, QEMU_PLUGIN_MEM_W, NULL);
    qemu_plugin_register_vcpu_insn_exec_inline(instruction, QEMU_PLUGIN_INLINE_ADD_U64, &instructions, 1);
    qemu_plugin_register_vcpu_insn_exec_inline(instruction, QEMU_PLUGIN_INLINE_ADD_U64, &operations,
                                               has_two_operations(address) ? 2 : 1);
  }
}

static void on_emulator_end(qemu_plugin_id_t id, void* data) {
  (void)id;
  (void)data;
  close_answers(false);
}

static bool read_order(const char* line) {
  struct Region region = {.active = false};
  struct Range range;
  if (sscanf(line, "region %63s %" SCNx64 " %" SCNx64, region.name, &region.begin, &region.end) == 3) {
    if (region_count == kRegions) return false;
    regions[region_count++] = region;
    return true;
  }
  if (sscanf(line, "code %" SCNx64 " %" SCNx64, &range.first, &range.end) == 2) {
    if (code_count == kRanges) return false;
    code[code_count++] = range;
    return true;
  }
  uint64_t pair;
  if (sscanf(line, "pair %" SCNx64, &pair) == 1) {
    if (two_operations_count == kPairs) return false;
    two_operations[two_operations_count++] = pair;
    return true;
  }
  if (sscanf(line, "stack %" SCNx64 " %" SCNx64 " %" SCNx64, &stack.first, &stack.end, &stack_start) == 3) return true;
  return sscanf(line, "finish %" SCNx64, &finish) == 1;
}

__attribute__((visibility("default"))) int qemu_plugin_install(qemu_plugin_id_t id, const qemu_info_t* info, int argc,
                                                               char** argv) {
  (void)info;
  FILE* orders = NULL;
  for (int i = 0; i < argc; ++i) {
    if (strncmp(argv[i], "orders=", 7) == 0) orders = fopen(argv[i] + 7, "r");
    if (strncmp(argv[i], "answers=", 8) == 0) answers = fopen(argv[i] + 8, "w");
  }
  if (orders == NULL || answers == NULL) {
    fputs("region.so: needs orders=FILE,answers=FILE\n", stderr);
    return -1;
  }
  char line[256];
  while (fgets(line, sizeof line, orders) != NULL) {
    if (!read_order(line)) {
      fprintf(stderr, "region.so: not understood or too many: %s", line);
      return -1;
    }
  }
  fclose(orders);
  qemu_plugin_register_vcpu_tb_trans_cb(id, translate);
  qemu_plugin_register_atexit_cb(id, on_emulator_end, NULL);
  return 0;
}
