// SPDX-License-Identifier: Apache-2.0
#include "hal/chip/stm32/serial_output.hpp"
#include "hal/chip/stm32/serial_port.hpp"

#include <gtest/gtest.h>

#include <map>
#include <random>
#include <string>
#include <vector>

namespace tetap::hal::stm32 {
namespace {

TEST(DmaRingIndex, CountsEveryByteHoweverLateTheInterruptIs) {
  constexpr std::uint32_t kSize = 16;
  std::mt19937 random{5};
  DmaRingIndex<kSize> index;
  std::uint32_t written = 0, rounds = 0;
  for (int i = 0; i < 200'000; ++i) {
    written += static_cast<std::uint32_t>(random() % kSize);  // less than a round between two looks
    // The interrupt of a round may still be to come; that of the one before has come.
    if (rounds + 1 < written / kSize || random() % 2 == 0) rounds = written / kSize;
    // NDTR may show 0 before it reloads.
    const std::uint32_t left = kSize - written % kSize;
    const std::uint32_t shown = left == kSize && random() % 2 == 0 ? 0 : left;
    ASSERT_EQ(index.update(rounds, shown), written) << i;
  }
}

TEST(DmaRingIndex, AWholeRoundAndMoreIsSeenOnceItsInterruptCame) {
  DmaRingIndex<16> index;
  EXPECT_EQ(index.update(0, 16), 0U);
  EXPECT_EQ(index.update(1, 16), 16U);
  EXPECT_EQ(index.update(4, 3), 77U);
  index.restart();
  EXPECT_EQ(index.update(0, 15), 1U);
}

// A USART and the two streams that serve it, from RM0402: offsets and bits are written down here once more.
class FakeLine {
 public:
  static constexpr std::uint32_t kReceive = 5, kTransmit = 7;

  std::vector<std::uint8_t> sent;
  std::uint32_t baud_divider = 0;
  bool answers = true;  ///< the transmit stream moves on

  void arrive(std::uint8_t byte) {
    Stream& s = streams_[kReceive];
    if ((s.cr & 1U) == 0 || (usart_[0x14] & 0x40U) == 0) return;
    *pointer(s.m0ar + (s.size - s.ndtr)) = byte;
    if (--s.ndtr == 0) {
      s.ndtr = s.size;
      high_flags_ |= 1U << (5 + 6);  // TCIF5
    }
  }
  /// One byte leaves.
  void transmit() {
    Stream& s = streams_[kTransmit];
    if (!answers || (s.cr & 1U) == 0 || s.ndtr == 0) return;
    sent.push_back(*pointer(s.m0ar + (s.size - s.ndtr)));
    if (--s.ndtr > 0) return;
    s.cr &= ~1U;
    high_flags_ |= 1U << (5 + 22);  // TCIF7
    last_bit_out_ = true;
  }
  /// The last stop bit.
  void finish() {
    if (last_bit_out_) usart_[0x00] |= 0x40U;
  }
  void damage(std::uint32_t bits) { usart_[0x00] |= bits; }
  [[nodiscard]] bool round_interrupt() const { return (high_flags_ & 1U << 11) != 0; }
  [[nodiscard]] std::uint32_t left() { return streams_[kReceive].ndtr; }

  std::uint32_t read(bool is_dma, std::uint32_t offset) {
    if (!is_dma) {
      if (offset == 0x04) usart_[0x00] &= ~0x0FU;
      return usart_[offset];
    }
    if (offset == 0x04) return high_flags_;
    Stream& s = streams_[(offset - 0x10) / 0x18];
    return (offset - 0x10) % 0x18 == 0 ? s.cr : (offset - 0x10) % 0x18 == 4 ? s.ndtr : 0U;
  }
  void write(bool is_dma, std::uint32_t offset, std::uint32_t value) {
    if (!is_dma) {
      if (offset == 0x00) {
        usart_[0x00] &= value;  // TC is cleared by 0
        last_bit_out_ = false;
      } else {
        usart_[offset] = value;
      }
      if (offset == 0x08) baud_divider = value;
      return;
    }
    if (offset == 0x0C) {
      high_flags_ &= ~value;
      return;
    }
    if (offset < 0x10) return;
    Stream& s = streams_[(offset - 0x10) / 0x18];
    switch ((offset - 0x10) % 0x18) {
      case 0:
        s.cr = value;
        return;
      case 4:
        if ((s.cr & 1U) == 0) s.ndtr = s.size = value;
        return;
      case 0xC:
        s.m0ar = value;
        return;
      default:
        return;
    }
  }
  std::uintptr_t memory = 0;  ///< anything near the port: DMA knows 32 bits of an address

 private:
  struct Stream {
    std::uint32_t cr = 0, ndtr = 0, size = 0, m0ar = 0;
  };
  [[nodiscard]] std::uint8_t* pointer(std::uint32_t low) const {
    return reinterpret_cast<std::uint8_t*>((memory & ~std::uintptr_t{0xFFFF'FFFF}) | low);
  }
  std::map<std::uint32_t, Stream> streams_;
  std::map<std::uint32_t, std::uint32_t> usart_;
  std::uint32_t high_flags_ = 0;
  bool last_bit_out_ = false;
};
struct LineRegisters {
  FakeLine* line;
  bool is_dma;
  [[nodiscard]] std::uint32_t read(std::uint32_t offset) const { return line->read(is_dma, offset); }
  void write(std::uint32_t offset, std::uint32_t value) const { line->write(is_dma, offset, value); }
};
struct NoLock {
  NoLock() {}
  ~NoLock() {}
};

class SerialPortTest : public testing::Test {
 protected:
  using Port = SerialPort<LineRegisters, NoLock, 64, 16>;

  SerialPortTest() {
    line.memory = reinterpret_cast<std::uintptr_t>(&port);
    port.start(96'000'000, 38'400);
  }
  void arrive(int count) {
    for (int i = 0; i < count; ++i) {
      line.arrive(next_in_++);
      if (line.round_interrupt()) port.on_dma_interrupt();
    }
  }
  std::vector<std::uint8_t> read(std::size_t most) {
    std::vector<std::uint8_t> bytes(most);
    bytes.resize(port.read(bytes));
    return bytes;
  }

  FakeLine line;
  Port port{
      {&line, false}, 0x4001'1004, {{&line, true}, FakeLine::kReceive, 4}, {{&line, true}, FakeLine::kTransmit, 4}};
  std::uint8_t next_in_ = 0;
};

TEST_F(SerialPortTest, EveryByteOnceInOrderExactlyAtTheEndOfTheRing) {
  EXPECT_EQ(line.baud_divider, 2'500U);
  std::uint8_t next_out = 0;
  for (int i = 0; i < 2'000; ++i) {
    arrive(i % 5 == 0 ? 64 : i % 64);  // as many as the ring holds, too
    for (auto bytes = read(17); !bytes.empty(); bytes = read(17)) {
      for (const std::uint8_t byte : bytes) ASSERT_EQ(byte, next_out++);
    }
    ASSERT_EQ(next_out, next_in_);
  }
  EXPECT_EQ(port.faults().lapped, 0U);
}

TEST_F(SerialPortTest, ALappedRingIsCountedToTheByteAndGoesOn) {
  arrive(10);
  EXPECT_EQ(read(4).size(), 4U);
  arrive(59);  // one more than there was room for
  EXPECT_TRUE(read(64).empty());
  EXPECT_EQ(port.faults().lapped, 65U);
  arrive(3);
  EXPECT_EQ(read(64), (std::vector<std::uint8_t>{69, 70, 71}));
  arrive(64 * 3);
  EXPECT_TRUE(read(64).empty());
  EXPECT_EQ(port.faults().lapped, 65U + 192U);
}

TEST_F(SerialPortTest, OneMessageAtATimeAndABaudRateBehindIt) {
  const std::string text = "0123456789abcdefXYZ";
  const std::vector<std::uint8_t> message(text.begin(), text.end());
  EXPECT_EQ(port.write(message), 16U);
  EXPECT_EQ(port.write(std::span(message).subspan(16)), 0U);
  port.set_baud(115'200);
  for (int i = 0; i < 16; ++i) {
    EXPECT_EQ(line.baud_divider, 2'500U);
    line.transmit();
    static_cast<void>(read(1));
  }
  EXPECT_EQ(port.write(std::span(message).subspan(16)), 0U);
  EXPECT_EQ(line.baud_divider, 2'500U) << "the last stop bit is still to come";
  line.finish();
  arrive(5);
  EXPECT_TRUE(read(8).empty());  // what came at the old rate is lost
  EXPECT_EQ(line.baud_divider, 833U);
  EXPECT_EQ(port.write(std::span(message).subspan(16)), 3U);
  for (int i = 0; i < 3; ++i) line.transmit();
  EXPECT_EQ(std::string(line.sent.begin(), line.sent.end()), text);
  arrive(2);
  EXPECT_EQ(read(8), (std::vector<std::uint8_t>{5, 6}));
}

TEST_F(SerialPortTest, DamageIsCountedAndCleared) {
  line.damage(8);
  port.on_error_interrupt();
  line.damage(2);
  port.on_error_interrupt();
  line.damage(4);
  port.on_error_interrupt();
  port.on_error_interrupt();
  EXPECT_EQ(port.faults().overrun, 1U);
  EXPECT_EQ(port.faults().framing, 2U);
}

// A transmitter that takes one character and then needs some looks until it takes the next.
struct SlowRegisters {
  std::string* out;
  int* busy;
  [[nodiscard]] std::uint32_t read(std::uint32_t) const { return (*busy)-- > 0 ? 0 : 0x80; }
  void write(std::uint32_t offset, std::uint32_t value) const {
    if (offset != 0x04) return;
    out->push_back(static_cast<char>(value));
    *busy = 1'400;
  }
};

TEST(SerialOutput, NeverWaitsInTheLoopAndCutsWhatDoesNotFit) {
  std::string out;
  int busy = 0;
  SerialOutput<SlowRegisters, 8> console{SlowRegisters{&out, &busy}};
  console.print("0123456789");
  EXPECT_EQ(out, "");
  console.drain();
  EXPECT_EQ(out, "0");
  console.drain();
  EXPECT_EQ(out, "0");
  console.finish();
  EXPECT_EQ(out, "01234567");
  console.print("ab");
  console.finish();
  EXPECT_EQ(out, "01234567ab");
}

}  // namespace
}  // namespace tetap::hal::stm32
