// SPDX-License-Identifier: Apache-2.0
// A CAN bus formed of two files in candump's log form, "(seconds) interface 123#DEADBEEF": one for reception, one for
// transmission. It serves runs of the whole firmware on an emulated core that has no CAN controller. A line that is not
// a data frame is counted as a lost frame (rx_overflow) and passed over.
#pragma once

#include "hal/board/mps2/candump_line.hpp"
#include "hal/can_bus.hpp"
#include "hal/chip/arm/semihosting.hpp"
#include "tetap/base/can_frame.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

namespace tetap::hal::mps2 {

class FileCan {
 public:
  /// Either path may be null: no input, output only counted and hashed.
  [[nodiscard]] bool open(const char* in, const char* out) {
    if (in != nullptr && (in_ = semihosting::open(in, semihosting::Mode::kRead)) == semihosting::kNoFile) return false;
    return out == nullptr || (out_ = semihosting::open(out, semihosting::Mode::kWrite)) != semihosting::kNoFile;
  }

  /// Writes what is still buffered; false when anything could not be written.
  [[nodiscard]] bool close() {
    drain();
    if (in_ != semihosting::kNoFile) good_ = semihosting::close(in_) && good_;
    if (out_ != semihosting::kNoFile) good_ = semihosting::close(out_) && good_;
    in_ = out_ = semihosting::kNoFile;
    return good_;
  }

  /// From now on only these frames are received.
  void accept(Acceptance wanted) { wanted_ = wanted; }

  [[nodiscard]] bool at_end() const { return end_; }
  [[nodiscard]] std::uint32_t sent() const { return sent_; }
  [[nodiscard]] std::uint32_t hash() const {
    return hash_;
  }  ///< FNV-1a over identifier, size and data of every frame sent

  [[nodiscard]] std::optional<base::CanFrame> receive() {
    while (!end_) {
      std::array<char, 96> line;
      std::size_t size = 0;
      for (int c = next(); c >= 0 && c != '\n'; c = next()) {
        if (size < line.size()) line[size++] = static_cast<char>(c);
      }
      if (size == 0) continue;
      const auto frame = parse_candump(line.data(), size);
      if (frame && (wanted_.mask == 0 || wanted_.takes(*frame))) return frame;
      if (!frame) ++faults_.rx_overflow;
    }
    return std::nullopt;
  }

  [[nodiscard]] bool send(const base::CanFrame& frame) {
    ++sent_;
    for (unsigned shift = 0; shift < 32; shift += 8) mix(static_cast<std::uint8_t>(frame.id >> shift));
    mix(frame.size);
    for (std::size_t i = 0; i < frame.size; ++i) mix(frame.data[i]);
    if (out_ == semihosting::kNoFile) return true;
    put("(0.000000) can0 ");
    hex(frame.id, frame.extended ? 8 : 3);
    put("#");
    for (std::size_t i = 0; i < frame.size; ++i) hex(frame.data[i], 2);
    put("\n");
    return true;
  }

  void flush() {
    if (out_size_ > out_buffer_.size() / 2) drain();
  }
  [[nodiscard]] base::CanFaults faults() const { return faults_; }

 private:
  int next() {
    if (in_at_ == in_size_) {
      in_at_ = 0;
      in_size_ = in_ == semihosting::kNoFile ? 0 : semihosting::read(in_, in_buffer_.data(), in_buffer_.size());
      if (in_size_ == 0) {
        end_ = true;
        return -1;
      }
    }
    return static_cast<unsigned char>(in_buffer_[in_at_++]);
  }
  void mix(std::uint8_t byte) { hash_ = (hash_ ^ byte) * 16'777'619U; }
  void put(char c) {
    if (out_size_ == out_buffer_.size()) drain();
    out_buffer_[out_size_++] = c;
  }
  void put(const char* text) {
    for (; *text != '\0'; ++text) put(*text);
  }
  void hex(std::uint32_t value, unsigned digits) {
    while (digits-- > 0) put("0123456789ABCDEF"[(value >> (4 * digits)) & 15U]);
  }
  void drain() {
    if (out_size_ > 0 && out_ != semihosting::kNoFile)
      good_ = semihosting::write(out_, out_buffer_.data(), out_size_) && good_;
    out_size_ = 0;
  }

  std::uint32_t in_ = semihosting::kNoFile;
  std::uint32_t out_ = semihosting::kNoFile;
  Acceptance wanted_;  ///< a mask of 0: every frame
  bool end_ = false;
  bool good_ = true;
  std::size_t in_at_ = 0;
  std::size_t in_size_ = 0;
  std::size_t out_size_ = 0;
  std::uint32_t sent_ = 0;
  std::uint32_t hash_ = 2'166'136'261U;
  base::CanFaults faults_{};
  std::array<char, 256> in_buffer_{};
  std::array<char, 512> out_buffer_{};
};

static_assert(hal::CanBus<FileCan>);

}  // namespace tetap::hal::mps2
