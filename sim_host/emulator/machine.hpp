// SPDX-License-Identifier: Apache-2.0
// Executes an image's machine code on the chip: the Unicorn engine as a Cortex-M4F, with our own exceptions, faults,
// sleep and time. ARM DDI 0403E.e sections B1.5.6 to B1.5.8 (exception entry, return), B1.5.19 (WFI), B1.5.14 (faults).
//
// Cycles are executed instructions times CPI. A block of instructions is counted when it is entered: a register access
// has the time of its block's end. The engine is GPL-2.0: programs that link this are built, never shipped.
#pragma once

#include "sim_host/emulator/chip.hpp"
#include "sim_host/emulator/flash_controller.hpp"

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

typedef struct uc_struct uc_engine;

namespace tetap::board {

struct MachineOptions {
  int cpi_percent = 100;         ///< cycles of an instruction, times 100
  bool check_alignment = false;  ///< looks at every instruction for LDRD, LDM, VLDR ... at unaligned addresses; slow
};

/// Next instructions of a defective program or an upset core, in thread mode with interrupts on.
enum class Upset : std::uint8_t {
  kStackOverflow,         ///< pushes registers for ever, as a recursion without an end
  kBadRead,               ///< reads where nothing is
  kBadJump,               ///< jumps to where nothing is
  kUndefinedInstruction,  ///< UDF
  kUnalignedAccess,       ///< LDRD at an address that is no multiple of four
  kFloatingPointOff,      ///< CPACR is cleared
  kEndlessLoop,           ///< branches to itself; interrupts go on
};

/// Why run() returned.
enum class Stop : std::uint8_t { kTime, kReset, kLockup };

class Machine {
 public:
  static constexpr Picoseconds kSupplyOff = 100 * kMillisecond;

  Machine(Chip& chip, MachineOptions options);
  ~Machine();
  Machine(const Machine&) = delete;
  Machine& operator=(const Machine&) = delete;

  /// Copies what an ELF file loads into flash; empty, or what is wrong with it.
  [[nodiscard]] std::string load_elf(const std::string& path);
  /// Copies raw bytes into flash at `address`.
  void load(std::uint32_t address, std::span<const std::byte> bytes);

  /// Runs until `until`; resets are carried out and the run goes on. After a power-on the core starts kSupplyOff later.
  void run(Picoseconds until);
  /// The core executes nothing until then, as while its flash is erased: RM0402, "Read while write". Blocks run on.
  void stall(Picoseconds until) { stalled_until_ = until; }
  /// Takes effect when the core is in thread mode and PRIMASK is 0. What the core then complains of until its reset is
  /// in Complaints::provoked().
  void upset(Upset what) { upset_ = what; }
  /// The next system reset asked for by software or watchdog ends run() as well.
  bool stop_at_reset = false;

  [[nodiscard]] std::uint64_t instructions() const { return instructions_; }
  [[nodiscard]] std::uint64_t exceptions() const { return exceptions_; }
  [[nodiscard]] int resets() const { return static_cast<int>(reset_times_.size()); }
  [[nodiscard]] const std::vector<Picoseconds>& reset_times() const { return reset_times_; }
  /// When the last upset took effect; kNever: none did.
  [[nodiscard]] Picoseconds upset_time() const { return upset_time_; }
  [[nodiscard]] bool locked_up() const { return locked_up_; }
  /// Lowest value the main stack pointer had at an exception entry.
  [[nodiscard]] std::uint32_t lowest_stack() const { return lowest_stack_; }
  [[nodiscard]] std::uint32_t program_counter() const;
  /// Cycles since power-on.
  [[nodiscard]] std::int64_t cycles() const { return hundredths_ / 100; }

 private:
  struct Engine;
  friend struct Engine;

  void power_on();
  void copy(std::uint32_t address, std::span<const std::byte> bytes);
  void reset_core();
  void execute(Picoseconds until);
  void pass(Picoseconds until);
  void sleep(Picoseconds until);
  void handle_stop(int error);
  void handle_interrupt();
  void enter_exception(int number, std::uint32_t return_address);
  void return_from_exception(std::uint32_t exc_return);
  void fault(int number, std::uint32_t cfsr, bool with_address, std::uint32_t address);
  void take_pending();
  void synchronise();
  [[nodiscard]] bool has_to_stop();
  void on_block(std::uint32_t address, std::uint32_t size);
  void on_instruction(std::uint32_t address, std::uint32_t size);
  std::uint64_t on_read(std::uint32_t address, unsigned size);
  void on_write(std::uint32_t address, unsigned size, std::uint64_t value);
  void plan_stop(Picoseconds until);
  [[nodiscard]] std::uint32_t upset_area() const;
  [[nodiscard]] bool upset_due() const;
  void begin_upset();
  void apply_mpu();
  void apply_flash();
  void undo_stores();
  void catch_up();
  bool on_flash_store(std::uint32_t address, unsigned size, std::uint64_t value);
  std::uint64_t on_flash_read(std::uint32_t address, unsigned size);
  [[nodiscard]] bool fetch_stalls(std::uint32_t address) const;
  void read_directly(std::uint32_t offset, std::uint32_t size, bool direct);
  [[nodiscard]] bool guarded(std::uint32_t address, std::uint32_t size) const;
  std::uint64_t on_guard_read(std::uint32_t address, unsigned size);
  void on_guard_write(std::uint32_t address, unsigned size, std::uint64_t value);
  [[nodiscard]] std::uint16_t half_word(std::uint32_t address) const;
  [[nodiscard]] Masks masks() const;
  [[nodiscard]] std::uint32_t reg(int id) const;
  void set_reg(int id, std::uint32_t value);
  [[nodiscard]] bool push_frame(std::uint32_t return_address, std::uint32_t& exc_return);
  void pop_frame(std::uint32_t exc_return);
  void watch_for_storm(int number);

  struct BlockInfo {
    std::uint16_t size = 0, instructions = 0;
    bool floating_point = false;
  };
  [[nodiscard]] const BlockInfo& block_info(std::uint32_t address, std::uint32_t size);

  Chip& chip_;
  MachineOptions options_;
  uc_engine* uc_ = nullptr;
  std::vector<BlockInfo> flash_blocks_, ram_blocks_;

  std::int64_t hundredths_ = 0;  ///< cycles times 100
  std::int64_t stop_hundredths_ = 0;
  Picoseconds planned_for_ = 0, until_ = 0, stalled_until_ = 0;
  std::int64_t planned_hz_ = 0;
  std::uint32_t program_counter_ = 0;
  std::uint32_t image_ = 0xFFFF'FFFE;  ///< lowest address that was loaded
  std::uint32_t block_end_ = 0;
  bool first_block_ = false, sleeping_ = false, locked_up_ = false;

  // Reasons for the last stop of the engine.
  int engine_interrupt_ = -1;
  struct Pending {
    int number = 0;
    std::uint32_t cfsr = 0, address = 0;
    bool with_address = false;
  } pending_fault_;
  std::uint32_t bad_address_ = 0;
  bool bad_instruction_ = false;

  std::vector<std::pair<std::uint32_t, std::uint32_t>> guards_;  ///< first and last address of each region
  std::vector<std::uint32_t> guard_pages_;
  /// Part of the flash that is looked at when it is read: it is busy, or its check bits are wrong.
  struct FlashWindow {
    Machine* machine;
    std::uint32_t base;
  };
  struct Stored {
    std::uint32_t offset;
    std::vector<std::byte> before;
  };
  FlashController& flash_;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> watched_;  ///< offset and size of each part
  std::vector<std::unique_ptr<FlashWindow>> windows_;
  std::vector<Stored> stored_;  ///< the engine writes into the flash; the controller decides what stays
  bool flash_busy_ = false, flash_changed_ = false;
  std::vector<int> active_;  ///< stack of exceptions
  int storm_number_ = 0, storm_count_ = 0;
  std::uint64_t instructions_ = 0, exceptions_ = 0;
  std::uint32_t lowest_stack_ = 0xFFFF'FFFF;
  std::vector<Picoseconds> reset_times_;
  std::optional<Upset> upset_;
  Picoseconds upset_time_ = kNever;
};

}  // namespace tetap::board
