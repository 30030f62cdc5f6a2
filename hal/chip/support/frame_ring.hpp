// SPDX-License-Identifier: Apache-2.0
// A ring between the loop and an interrupt: one side puts, the other takes. Positions count on for ever, and each has
// one writer.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>

namespace tetap::hal {

template <class Entry, std::uint32_t Capacity>
class FrameRing {
 public:
  static_assert((Capacity & (Capacity - 1)) == 0, "positions wrap at 2^32");

  [[nodiscard]] std::uint32_t size() const {
    return put_.load(std::memory_order_acquire) - taken_.load(std::memory_order_acquire);
  }
  /// Place of the next entry, for the side that puts; null: no room. publish() gives it to the other side.
  [[nodiscard]] Entry* vacant() {
    const std::uint32_t next = put_.load(std::memory_order_relaxed);
    return next - taken_.load(std::memory_order_acquire) == Capacity ? nullptr : &entries_[next % Capacity];
  }
  void publish() { put_.store(put_.load(std::memory_order_relaxed) + 1, std::memory_order_release); }
  /// The oldest entry; only where size() is not 0.
  [[nodiscard]] const Entry& oldest() const { return entries_[taken_.load(std::memory_order_relaxed) % Capacity]; }
  void drop_oldest() { taken_.store(taken_.load(std::memory_order_relaxed) + 1, std::memory_order_release); }
  /// By the side that takes.
  void clear() { taken_.store(put_.load(std::memory_order_acquire), std::memory_order_release); }

 private:
  std::atomic<std::uint32_t> put_{0};
  std::atomic<std::uint32_t> taken_{0};
  std::array<Entry, Capacity> entries_{};
};

}  // namespace tetap::hal
