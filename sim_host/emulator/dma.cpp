// SPDX-License-Identifier: Apache-2.0
#include "sim_host/emulator/dma.hpp"

#include "hal/chip/stm32/registers_stm32f412.hpp"

#include <cstring>

namespace tetap::board {

namespace reg = hal::stm32f412::dma;

namespace {

struct Mapping {
  DmaRequest request;
  int controller, stream;
  std::uint32_t channel;
};

// RM0402, tables "DMA1 request mapping" and "DMA2 request mapping".
constexpr Mapping kMappings[] = {
    {DmaRequest::kSpi1Rx, 2, 0, 3},   {DmaRequest::kSpi1Rx, 2, 2, 3},   {DmaRequest::kSpi1Tx, 2, 3, 3},
    {DmaRequest::kSpi1Tx, 2, 5, 3},   {DmaRequest::kSpi1Tx, 2, 2, 2},   {DmaRequest::kSpi2Rx, 1, 3, 0},
    {DmaRequest::kSpi2Tx, 1, 4, 0},   {DmaRequest::kUsart1Rx, 2, 2, 4}, {DmaRequest::kUsart1Rx, 2, 5, 4},
    {DmaRequest::kUsart1Tx, 2, 7, 4}, {DmaRequest::kUsart2Rx, 1, 5, 4}, {DmaRequest::kUsart2Tx, 1, 6, 4},
};

// LISR.TCIF0 and so on; the four streams of a register lie at bits 0, 6, 16 and 22.
constexpr std::uint32_t kTransferError = reg::lisr::kTeif0.mask(), kHalf = reg::lisr::kHtif0.mask(),
                        kComplete = reg::lisr::kTcif0.mask(), kAllFlags = 0x3D;
constexpr int kShift[] = {reg::lisr::kFeif0.lsb, reg::lisr::kFeif1.lsb, reg::lisr::kFeif2.lsb, reg::lisr::kFeif3.lsb};

// Stream 1 of DMA1 has no interrupt in the list of registers: no modelled peripheral uses it.
constexpr int kInterrupts[2][8] = {{hal::stm32f412::interrupt::kDma1Stream0, -1,
                                    hal::stm32f412::interrupt::kDma1Stream2, hal::stm32f412::interrupt::kDma1Stream3,
                                    hal::stm32f412::interrupt::kDma1Stream4, hal::stm32f412::interrupt::kDma1Stream5,
                                    hal::stm32f412::interrupt::kDma1Stream6, hal::stm32f412::interrupt::kDma1Stream7},
                                   {hal::stm32f412::interrupt::kDma2Stream0, hal::stm32f412::interrupt::kDma2Stream1,
                                    hal::stm32f412::interrupt::kDma2Stream2, hal::stm32f412::interrupt::kDma2Stream3,
                                    hal::stm32f412::interrupt::kDma2Stream4, hal::stm32f412::interrupt::kDma2Stream5,
                                    hal::stm32f412::interrupt::kDma2Stream6, hal::stm32f412::interrupt::kDma2Stream7}};

}  // namespace

Dma::Dma(Surroundings around, int controller, std::uint32_t base, Memory& memory)
    : Peripheral(around, "DMA" + std::to_string(controller), base, kBytes), controller_(controller), memory_(memory) {}

void Dma::reset() {
  streams_ = {};
  for (int i = 0; i < 8; ++i) update(i);
}

std::uint32_t Dma::read(std::uint32_t offset) {
  if (offset == reg::lisr::kOffset || offset == reg::hisr::kOffset) {
    std::uint32_t word = 0;
    const std::size_t first = offset == reg::lisr::kOffset ? 0 : 4;
    for (std::size_t i = 0; i < 4; ++i) word |= streams_[first + i].flags << kShift[i];
    return word;
  }
  if (offset < reg::sxcr::kOffset) return 0;
  const std::uint32_t number = (offset - reg::sxcr::kOffset) / reg::sxcr::kStride;
  if (number >= streams_.size()) return 0;
  const Stream& stream = streams_[number];
  switch (offset - number * reg::sxcr::kStride) {
    case reg::sxcr::kOffset:
      return stream.cr;
    case reg::sxndtr::kOffset:
      return stream.ndtr;
    case reg::sxpar::kOffset:
      return stream.par;
    case reg::sxm0ar::kOffset:
      return stream.m0ar;
    case reg::sxfcr::kOffset:
      return stream.fcr;
    default:
      return 0;
  }
}

void Dma::write(std::uint32_t offset, std::uint32_t value, std::uint32_t mask) {
  if (offset == reg::lifcr::kOffset || offset == reg::hifcr::kOffset) {
    const std::size_t first = offset == reg::lifcr::kOffset ? 0 : 4;
    for (std::size_t i = 0; i < 4; ++i) {
      streams_[first + i].flags &= ~((value & mask) >> kShift[i] & kAllFlags);
      update(static_cast<int>(first + i));
    }
    return;
  }
  if (offset < reg::sxcr::kOffset) return;
  const std::uint32_t number = (offset - reg::sxcr::kOffset) / reg::sxcr::kStride;
  if (number >= streams_.size()) return;
  Stream& stream = streams_[number];
  const std::uint32_t local = offset - number * reg::sxcr::kStride;
  if (local == reg::sxcr::kOffset) {
    std::uint32_t cr = stream.cr;
    merge(cr, value, mask);
    return write_cr(static_cast<int>(number), cr);
  }
  if (reg::sxcr::kEn.of(stream.cr) != 0) {
    return complain(label(static_cast<int>(number)) + ": NDTR, PAR, M0AR or FCR written while EN = 1: ignored");
  }
  if (local == reg::sxndtr::kOffset) merge(stream.ndtr, value & 0xFFFF, mask);
  if (local == reg::sxpar::kOffset) merge(stream.par, value, mask);
  if (local == reg::sxm0ar::kOffset) merge(stream.m0ar, value, mask);
  if (local == reg::sxfcr::kOffset) merge(stream.fcr, value & 0x87, mask);
}

void Dma::write_cr(int number, std::uint32_t value) {
  Stream& stream = streams_[static_cast<std::size_t>(number)];
  const bool was = reg::sxcr::kEn.of(stream.cr) != 0, is = reg::sxcr::kEn.of(value) != 0;
  if (was && is && ((stream.cr ^ value) & ~0x1FU) != 0) {
    complain(label(number) + ": CR changed while EN = 1: only EN and interrupt bits may");
    value = (stream.cr & ~0x1FU) | (value & 0x1F);
  }
  stream.cr = value;
  if (is && !was) enable(number);
  if (!is && was && stream.ndtr != 0) stream.flags |= kComplete;  // RM0402: switched off early, TCIF is set
  update(number);
}

void Dma::enable(int number) {
  Stream& stream = streams_[static_cast<std::size_t>(number)];
  if (stream.flags != 0) {
    complain(label(number) + ": switched on with flags of the last transfer set");
    stream.cr &= ~reg::sxcr::kEn.mask();  // RM0402: the stream is not ready to be switched on
    return;
  }
  if (stream.ndtr == 0) complain(label(number) + ": switched on with NDTR = 0");
  if (reg::sxcr::kDbm.of(stream.cr) != 0) complain(label(number) + ": double buffer mode is not modelled");
  if (reg::sxcr::kDir.of(stream.cr) > 1) complain(label(number) + ": memory to memory is not modelled");
  if (reg::sxcr::kPburst.of(stream.cr) != 0 || reg::sxcr::kMburst.of(stream.cr) != 0) {
    complain(label(number) + ": bursts are not modelled");
  }
  const std::uint32_t memory_size = 1U << reg::sxcr::kMsize.of(stream.cr);
  const std::uint32_t peripheral_size = 1U << reg::sxcr::kPsize.of(stream.cr);
  if (stream.m0ar % memory_size != 0 || stream.par % peripheral_size != 0) {
    return fail(number, "address not aligned to its item size");
  }
  const std::uint32_t length = stream.ndtr * peripheral_size;
  const bool reads_memory = reg::sxcr::kDir.of(stream.cr) == 1;
  const std::uint32_t span = reg::sxcr::kMinc.of(stream.cr) != 0 ? length : memory_size;
  const bool there =
      reads_memory ? !memory_.readable(stream.m0ar, span).empty() : !memory_.writable(stream.m0ar, span).empty();
  if (!there) return fail(number, "memory address range is no memory that DMA reaches");
  stream.reload = stream.ndtr;
  stream.memory = stream.m0ar;
  stream.peripheral = stream.par;
  if (on_enable) on_enable();
}

void Dma::fail(int number, const std::string& why) {
  Stream& stream = streams_[static_cast<std::size_t>(number)];
  complain(label(number) + ": " + why);
  stream.flags |= kTransferError;
  stream.cr &= ~reg::sxcr::kEn.mask();
  update(number);
}

bool Dma::serve(DmaRequest request) {
  if (!clocked()) return false;
  for (const Mapping& one : kMappings) {
    if (one.request != request || one.controller != controller_) continue;
    const Stream& stream = streams_[static_cast<std::size_t>(one.stream)];
    if (reg::sxcr::kEn.of(stream.cr) == 0 || reg::sxcr::kChsel.of(stream.cr) != one.channel) continue;
    transfer(one.stream);
    return true;
  }
  return false;
}

bool Dma::move(int number, int peripheral_size, int memory_size) {
  Stream& stream = streams_[static_cast<std::size_t>(number)];
  const int size = memory_size < peripheral_size ? memory_size : peripheral_size;
  const auto bytes = static_cast<std::size_t>(size);
  if (reg::sxcr::kDir.of(stream.cr) == 1) {
    const auto from = memory_.readable(stream.memory, bytes);
    if (from.empty()) return false;
    std::uint32_t item = 0;
    std::memcpy(&item, from.data(), bytes);
    bus_write(stream.peripheral, item, peripheral_size);
    return true;
  }
  const std::uint32_t item = bus_read(stream.peripheral, peripheral_size);
  const auto to = memory_.writable(stream.memory, bytes);
  if (to.empty()) return false;
  std::memcpy(to.data(), &item, bytes);
  return true;
}

void Dma::transfer(int number) {
  Stream& stream = streams_[static_cast<std::size_t>(number)];
  const int peripheral_size = 1 << reg::sxcr::kPsize.of(stream.cr), memory_size = 1 << reg::sxcr::kMsize.of(stream.cr);
  if (!move(number, peripheral_size, memory_size)) return fail(number, "transfer to or from no memory");
  if (reg::sxcr::kMinc.of(stream.cr) != 0) stream.memory += static_cast<std::uint32_t>(memory_size);
  if (reg::sxcr::kPinc.of(stream.cr) != 0) stream.peripheral += static_cast<std::uint32_t>(peripheral_size);
  --stream.ndtr;
  if (stream.ndtr == stream.reload / 2) stream.flags |= kHalf;
  if (stream.ndtr == 0) {
    stream.flags |= kComplete;
    if (reg::sxcr::kCirc.of(stream.cr) != 0) {
      stream.ndtr = stream.reload;
      stream.memory = stream.m0ar;
      stream.peripheral = stream.par;
    } else {
      stream.cr &= ~reg::sxcr::kEn.mask();
    }
  }
  update(number);
}

void Dma::update(int number) {
  const Stream& stream = streams_[static_cast<std::size_t>(number)];
  const int interrupt = kInterrupts[controller_ - 1][number];
  if (interrupt < 0) return;
  const bool level = ((stream.flags & kComplete) != 0 && reg::sxcr::kTcie.of(stream.cr) != 0) ||
                     ((stream.flags & kHalf) != 0 && reg::sxcr::kHtie.of(stream.cr) != 0) ||
                     ((stream.flags & kTransferError) != 0 && reg::sxcr::kTeie.of(stream.cr) != 0);
  set_interrupt(interrupt, level);
}

}  // namespace tetap::board
