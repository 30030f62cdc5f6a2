// SPDX-License-Identifier: Apache-2.0
#include "sim_host/emulator/fdcan_ram.hpp"

#include "hal/chip/stm32/registers_stm32g474.hpp"

#include <algorithm>

namespace tetap::board {

namespace reg = hal::stm32g474::fdcan;

namespace {

constexpr std::uint32_t kPowerOn = 0xCDCD'CDCD;  // nothing may rely on what power-on leaves there

// Fields of S0, and of F0 and F1.
constexpr hal::Field kSft{30, 2}, kSfec{27, 3}, kSfid1{16, 11}, kSfid2{0, 11};
constexpr hal::Field kEfec{29, 3}, kEfid1{0, 29}, kEft{30, 2}, kEfid2{0, 29};

/// Codes of SFEC and EFEC: 1 and 2 the FIFO, 3 reject, 4 to 6 the same with priority; 0 and 7 switch the element off.
FdcanMatch action(std::uint32_t code, std::uint32_t index) {
  FdcanMatch match{.index = static_cast<int>(index), .matched = true, .priority = code >= 4};
  if (code == 1 || code == 5) match.fifo = 0;
  if (code == 2 || code == 6) match.fifo = 1;
  return match;
}

/// Types of SFT and EFT: range, two identifiers, identifier and mask.
bool fits(std::uint32_t type, std::uint32_t id, std::uint32_t first, std::uint32_t second) {
  if (type == 0) return id >= first && id <= second;
  if (type == 1) return id == first || id == second;
  return (id & second) == (first & second);
}

/// ANFS and ANFE: FIFO 0, FIFO 1, reject.
FdcanMatch unmatched(std::uint32_t code) { return {.fifo = code < 2 ? static_cast<int>(code) : -1}; }

FdcanMatch match_standard(const FdcanRam& ram, std::uint32_t rxgfc, std::uint32_t id) {
  for (std::uint32_t i = 0; i < standard_filters(rxgfc); ++i) {
    const std::uint32_t element = ram.at(fdcan_ram::kStandard + i), code = kSfec.of(element);
    if (kSft.of(element) == 3 || code == 0 || code == 7) continue;
    if (fits(kSft.of(element), id, kSfid1.of(element), kSfid2.of(element))) return action(code, i);
  }
  return unmatched(reg::rxgfc::kAnfs.of(rxgfc));
}

// EFT = 11 is a range that XIDAM leaves alone.
FdcanMatch match_extended(const FdcanRam& ram, const FdcanFilterSettings& settings, std::uint32_t id) {
  for (std::uint32_t i = 0; i < extended_filters(settings.rxgfc); ++i) {
    const std::uint32_t first = ram.at(fdcan_ram::kExtended + 2 * i), second = ram.at(fdcan_ram::kExtended + 2 * i + 1);
    const std::uint32_t code = kEfec.of(first), type = kEft.of(second);
    if (code == 0 || code == 7) continue;
    const std::uint32_t seen = type == 3 ? id : id & settings.xidam;
    if (fits(type == 3 ? 0 : type, seen, kEfid1.of(first), kEfid2.of(second))) return action(code, i);
  }
  return unmatched(reg::rxgfc::kAnfe.of(settings.rxgfc));
}

}  // namespace

FdcanRam::FdcanRam(Surroundings around, std::uint32_t base) : Peripheral(around, "SRAMCAN", base, kWords) {
  words_.fill(kPowerOn);
}

std::uint32_t FdcanRam::read(std::uint32_t offset) {
  const std::uint32_t word = offset / 4;
  if (word >= fdcan_ram::kWords) {
    complain("read behind the message RAM of FDCAN1");
    return 0;
  }
  if (const char* wrong = guard ? guard(word, false) : nullptr) complain(wrong);
  return words_[word];
}

void FdcanRam::write(std::uint32_t offset, std::uint32_t value, std::uint32_t mask) {
  const std::uint32_t word = offset / 4;
  if (word >= fdcan_ram::kWords) return complain("write behind the message RAM of FDCAN1");
  if (const char* wrong = guard ? guard(word, true) : nullptr) complain(wrong);
  merge(words_[word], value, mask);
  written_[word] = true;
}

std::uint32_t standard_filters(std::uint32_t rxgfc) {
  return std::min(reg::rxgfc::kLss.of(rxgfc), fdcan_ram::kStandardFilters);
}

std::uint32_t extended_filters(std::uint32_t rxgfc) {
  return std::min(reg::rxgfc::kLse.of(rxgfc), fdcan_ram::kExtendedFilters);
}

FdcanMatch match_filters(const FdcanRam& ram, const FdcanFilterSettings& settings, const CanOffer& frame) {
  const bool extended = frame.frame.extended;
  const std::uint32_t rejects = extended ? reg::rxgfc::kRrfe.of(settings.rxgfc) : reg::rxgfc::kRrfs.of(settings.rxgfc);
  if (frame.remote && rejects != 0) return {};
  return extended ? match_extended(ram, settings, frame.frame.id) : match_standard(ram, settings.rxgfc, frame.frame.id);
}

}  // namespace tetap::board
