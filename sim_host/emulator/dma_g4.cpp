// SPDX-License-Identifier: Apache-2.0
#include "sim_host/emulator/dma_g4.hpp"

#include "hal/chip/stm32/registers_stm32g474.hpp"

#include <algorithm>
#include <cstring>

namespace tetap::board {

namespace reg = hal::stm32g474::dma;
namespace mux_reg = hal::stm32g474::dmamux;
namespace spi = hal::stm32g474::spi;
namespace usart = hal::stm32g474::usart;
namespace irq = hal::stm32g474::interrupt;

namespace {

/// A request line: its number at the multiplexer, and the register that its transfers go to.
struct Source {
  DmaRequest request;
  std::uint32_t id, data_register;
};

// RM0440, table "DMAMUX: assignment of multiplexer inputs to resources".
constexpr Source kSources[] = {
    {DmaRequest::kSpi1Rx, 10, spi::kSpi1 + spi::dr::kOffset},
    {DmaRequest::kSpi1Tx, 11, spi::kSpi1 + spi::dr::kOffset},
    {DmaRequest::kUsart1Rx, 24, usart::kUsart1 + usart::rdr::kOffset},
    {DmaRequest::kUsart1Tx, 25, usart::kUsart1 + usart::tdr::kOffset},
    {DmaRequest::kUsart2Rx, 26, usart::kUsart2 + usart::rdr::kOffset},
    {DmaRequest::kUsart2Tx, 27, usart::kUsart2 + usart::tdr::kOffset},
};

constexpr std::uint32_t kGlobal = reg::isr::kGif1.mask(), kComplete = reg::isr::kTcif1.mask(),
                        kHalf = reg::isr::kHtif1.mask(), kError = reg::isr::kTeif1.mask();
constexpr std::uint32_t kWhileOn =
    reg::ccrx::kEn.mask() | reg::ccrx::kTcie.mask() | reg::ccrx::kHtie.mask() | reg::ccrx::kTeie.mask();
constexpr int kInterrupts[2][8] = {{irq::kDma1Ch1, irq::kDma1Ch2, irq::kDma1Ch3, irq::kDma1Ch4, irq::kDma1Ch5,
                                    irq::kDma1Ch6, irq::kDma1Ch7, irq::kDma1Ch8},
                                   {irq::kDma2Ch1, irq::kDma2Ch2, irq::kDma2Ch3, irq::kDma2Ch4, irq::kDma2Ch5,
                                    irq::kDma2Ch6, irq::kDma2Ch7, irq::kDma2Ch8}};

}  // namespace

Dmamux::Dmamux(Surroundings around) : Peripheral(around, "DMAMUX", mux_reg::kDmamux, kWords) {}

std::uint32_t Dmamux::read(std::uint32_t offset) { return offset / 4 < kChannels ? channels_[offset / 4] : 0; }

void Dmamux::write(std::uint32_t offset, std::uint32_t value, std::uint32_t mask) {
  if (offset / 4 >= kChannels) return complain("request generators and synchronisation flags are not modelled");
  std::uint32_t& channel = channels_[offset / 4];
  merge(channel, value, mask);
  if ((channel & (mux_reg::cxcr::kSe.mask() | mux_reg::cxcr::kEge.mask())) != 0)
    complain("synchronisation and events are not modelled");
  const std::uint32_t id = mux_reg::cxcr::kDmareqId.of(channel);
  const auto same = std::count_if(channels_.begin(), channels_.end(),
                                  [&](std::uint32_t one) { return mux_reg::cxcr::kDmareqId.of(one) == id; });
  if (id != 0 && same > 1)
    complain("request " + std::to_string(id) + " goes to two channels");  // RM0440, DMAMUX channels
}

std::uint32_t Dmamux::request_of(std::size_t channel) const { return mux_reg::cxcr::kDmareqId.of(channels_[channel]); }

DmaG4::DmaG4(Surroundings around, int controller, std::uint32_t base, Memory& memory, const Dmamux& mux)
    : Peripheral(around, "DMA" + std::to_string(controller), base, kBytes),
      controller_(controller),
      memory_(memory),
      mux_(mux) {}

void DmaG4::reset() {
  channels_ = {};
  for (std::size_t i = 0; i < kChannels; ++i) update(i);
}

std::uint32_t DmaG4::read(std::uint32_t offset) {
  if (offset == reg::isr::kOffset) {
    std::uint32_t word = 0;
    for (std::size_t i = 0; i < kChannels; ++i) word |= channels_[i].flags << 4 * i;
    return word;
  }
  if (offset < reg::ccrx::kOffset) return 0;
  const std::size_t number = (offset - reg::ccrx::kOffset) / reg::ccrx::kStride;
  if (number >= kChannels) return 0;
  const Channel& channel = channels_[number];
  switch (offset - static_cast<std::uint32_t>(number) * reg::ccrx::kStride) {
    case reg::ccrx::kOffset:
      return channel.ccr;
    case reg::cndtrx::kOffset:
      return channel.cndtr;
    case reg::cparx::kOffset:
      return channel.cpar;
    case reg::cmarx::kOffset:
      return channel.cmar;
    default:
      return 0;
  }
}

void DmaG4::write(std::uint32_t offset, std::uint32_t value, std::uint32_t mask) {
  if (offset == reg::ifcr::kOffset) {  // CGIF clears the other flags with it
    for (std::size_t i = 0; i < kChannels; ++i) {
      const std::uint32_t bits = (value & mask) >> 4 * i & 0xF;
      channels_[i].flags &= (bits & kGlobal) != 0 ? 0 : ~bits;
      if ((channels_[i].flags & ~kGlobal) == 0) channels_[i].flags = 0;
      update(i);
    }
    return;
  }
  if (offset < reg::ccrx::kOffset) return;
  const std::size_t number = (offset - reg::ccrx::kOffset) / reg::ccrx::kStride;
  if (number >= kChannels) return;
  Channel& channel = channels_[number];
  const std::uint32_t local = offset - static_cast<std::uint32_t>(number) * reg::ccrx::kStride;
  if (local == reg::ccrx::kOffset) {
    std::uint32_t ccr = channel.ccr;
    merge(ccr, value, mask);
    return write_ccr(number, ccr);
  }
  if (reg::ccrx::kEn.of(channel.ccr) != 0) {
    return complain(label(number) + ": CNDTR, CPAR or CMAR written while EN = 1: ignored");
  }
  if (local == reg::cndtrx::kOffset) merge(channel.cndtr, value & 0xFFFF, mask);
  if (local == reg::cparx::kOffset) merge(channel.cpar, value, mask);
  if (local == reg::cmarx::kOffset) merge(channel.cmar, value, mask);
}

void DmaG4::write_ccr(std::size_t number, std::uint32_t value) {
  Channel& channel = channels_[number];
  const bool was = reg::ccrx::kEn.of(channel.ccr) != 0, is = reg::ccrx::kEn.of(value) != 0;
  if (was && is && ((channel.ccr ^ value) & ~kWhileOn) != 0) {
    complain(label(number) + ": CCR changed while EN = 1: only EN and interrupt bits may");
    value = (channel.ccr & ~kWhileOn) | (value & kWhileOn);
  }
  channel.ccr = value;
  if (is && !was) enable(number);
  update(number);
}

// A transfer that another request paces than that of its register would move what is not there.
void DmaG4::check_route(std::size_t number) {
  const std::uint32_t id = request_of(number);
  const auto* source =
      std::find_if(std::begin(kSources), std::end(kSources), [&](const Source& one) { return one.id == id; });
  if (source == std::end(kSources)) {
    return complain(label(number) + ": switched on, but DMAMUX request " + std::to_string(id) + " is no modelled one");
  }
  if (source->data_register != channels_[number].cpar) {
    complain(label(number) + ": CPAR is not the register of DMAMUX request " + std::to_string(id));
  }
}

void DmaG4::enable(std::size_t number) {
  Channel& channel = channels_[number];
  if (channel.cndtr == 0) complain(label(number) + ": switched on with CNDTR = 0");
  if (reg::ccrx::kMem2mem.of(channel.ccr) != 0) complain(label(number) + ": memory to memory is not modelled");
  check_route(number);
  const std::uint32_t memory_size = 1U << reg::ccrx::kMsize.of(channel.ccr);
  const std::uint32_t peripheral_size = 1U << reg::ccrx::kPsize.of(channel.ccr);
  if (memory_size > 4 || peripheral_size > 4) return fail(number, "item size of 3 is reserved");
  if (channel.cmar % memory_size != 0 || channel.cpar % peripheral_size != 0)
    return fail(number, "address not aligned to its item size");
  const std::uint32_t span = reg::ccrx::kMinc.of(channel.ccr) != 0 ? channel.cndtr * memory_size : memory_size;
  const bool there = reg::ccrx::kDir.of(channel.ccr) != 0 ? !memory_.readable(channel.cmar, span).empty()
                                                          : !memory_.writable(channel.cmar, span).empty();
  if (!there) return fail(number, "memory address range is no memory that DMA reaches");
  channel.reload = channel.cndtr;
  channel.memory = channel.cmar;
  channel.peripheral = channel.cpar;
  if (on_enable) on_enable();
}

void DmaG4::raise(std::size_t number, std::uint32_t flag) { channels_[number].flags |= flag | kGlobal; }

// RM0440, "DMA error management": the channel is switched off.
void DmaG4::fail(std::size_t number, const std::string& why) {
  complain(label(number) + ": " + why);
  raise(number, kError);
  channels_[number].ccr &= ~reg::ccrx::kEn.mask();
  update(number);
}

bool DmaG4::serve(DmaRequest request) {
  if (!clocked()) return false;
  const auto* source =
      std::find_if(std::begin(kSources), std::end(kSources), [&](const Source& one) { return one.request == request; });
  if (source == std::end(kSources)) return false;
  for (std::size_t i = 0; i < kChannels; ++i) {
    const Channel& channel = channels_[i];
    if (reg::ccrx::kEn.of(channel.ccr) == 0 || channel.cndtr == 0 || request_of(i) != source->id) continue;
    transfer(i);
    return true;
  }
  return false;
}

bool DmaG4::move(std::size_t number) {
  Channel& channel = channels_[number];
  const int peripheral_size = 1 << reg::ccrx::kPsize.of(channel.ccr),
            memory_size = 1 << reg::ccrx::kMsize.of(channel.ccr);
  const auto bytes = static_cast<std::size_t>(std::min(memory_size, peripheral_size));
  if (reg::ccrx::kDir.of(channel.ccr) != 0) {
    const auto from = memory_.readable(channel.memory, bytes);
    if (from.empty()) return false;
    std::uint32_t item = 0;
    std::memcpy(&item, from.data(), bytes);
    bus_write(channel.peripheral, item, peripheral_size);
  } else {
    const std::uint32_t item = bus_read(channel.peripheral, peripheral_size);
    const auto to = memory_.writable(channel.memory, bytes);
    if (to.empty()) return false;
    std::memcpy(to.data(), &item, bytes);
  }
  if (reg::ccrx::kMinc.of(channel.ccr) != 0) channel.memory += static_cast<std::uint32_t>(memory_size);
  if (reg::ccrx::kPinc.of(channel.ccr) != 0) channel.peripheral += static_cast<std::uint32_t>(peripheral_size);
  return true;
}

void DmaG4::transfer(std::size_t number) {
  Channel& channel = channels_[number];
  if (!move(number)) return fail(number, "transfer to or from no memory");
  --channel.cndtr;
  if (channel.cndtr == channel.reload / 2) raise(number, kHalf);
  if (channel.cndtr == 0) {
    raise(number, kComplete);
    if (reg::ccrx::kCirc.of(channel.ccr) != 0) {  // else EN stays set, and nothing moves any more
      channel.cndtr = channel.reload;
      channel.memory = channel.cmar;
      channel.peripheral = channel.cpar;
    }
  }
  update(number);
}

void DmaG4::update(std::size_t number) {
  const Channel& channel = channels_[number];
  const bool level = ((channel.flags & kComplete) != 0 && reg::ccrx::kTcie.of(channel.ccr) != 0) ||
                     ((channel.flags & kHalf) != 0 && reg::ccrx::kHtie.of(channel.ccr) != 0) ||
                     ((channel.flags & kError) != 0 && reg::ccrx::kTeie.of(channel.ccr) != 0);
  set_interrupt(kInterrupts[controller_ - 1][number], level);
}

}  // namespace tetap::board
