// SPDX-License-Identifier: Apache-2.0
#include "sim_host/emulator/can.hpp"

#include "hal/chip/stm32/registers_stm32f412.hpp"

#include <algorithm>
#include <cstring>

namespace tetap::board {

namespace reg = hal::stm32f412::can;
namespace irq = hal::stm32f412::interrupt;

namespace {

constexpr std::uint32_t kRequestDone = 1, kSentOk = 2, kArbitrationLost = 4, kTransmitError = 8;
constexpr Picoseconds kModeChange = 5 * kMicrosecond;  // a few bit times; the manual gives no number
constexpr int kSynchronise = 11;                       // recessive bits before normal mode
constexpr std::int64_t kRecovery = 128 * 11;           // recessive bits before bus-off ends

}  // namespace

Can::Can(Surroundings around, const Pins& pins, std::function<std::int64_t()> clock_hz)
    : Peripheral(around, "CAN1", reg::kCan1, kWords),
      line(around.scheduler, *this),
      pins_(pins),
      clock_hz_(std::move(clock_hz)),
      mode_change_(around.scheduler, [this] { mode_reached(); }),
      recovery_(around.scheduler, [this] { recovered(); }),
      loop_(around.scheduler, [this] { sent(); }) {
  reset();
}

void Can::reset() {
  mcr_ = reg::mcr::kResetValue;
  btr_ = reg::btr::kResetValue;
  ier_ = lec_ = 0;
  mailboxes_.fill({});
  for (Fifo& fifo : fifos_) fifo = {};
  filters_.reset();
  mode_ = Mode::kSleep;
  erri_ = error_seen_ = bus_off_ = false;
  tec_ = rec_ = 0;
  sending_ = -1;
  requests_ = 0;
  mode_change_.clear();
  recovery_.clear();
  loop_.clear();
  update();
}

bool Can::loop_back() const { return reg::btr::kLbkm.of(btr_) != 0; }
bool Can::silent() const { return reg::btr::kSilm.of(btr_) != 0; }

std::int64_t Can::bit_rate() const {
  const std::int64_t quanta = 3 + std::int64_t{reg::btr::kTs1.of(btr_)} + reg::btr::kTs2.of(btr_);
  return clock_hz_() / (std::int64_t{reg::btr::kBrp.of(btr_)} + 1) / quanta;
}

double Can::rate_tolerance() const {
  return rate_tolerance_of(reg::btr::kTs1.of(btr_) + 1.0, reg::btr::kTs2.of(btr_) + 1.0, reg::btr::kSjw.of(btr_) + 1.0);
}

std::uint32_t Can::msr() const {
  const bool rx = !line.stuck_dominant;
  return reg::msr::kInak(mode_ == Mode::kInitialisation ? 1 : 0) | reg::msr::kSlak(mode_ == Mode::kSleep ? 1 : 0) |
         reg::msr::kErri(erri_ ? 1 : 0) | reg::msr::kTxm(sending_ >= 0 ? 1 : 0) | reg::msr::kSamp(rx ? 1 : 0) |
         reg::msr::kRx(rx ? 1 : 0);
}

std::uint32_t Can::tsr() const {
  std::uint32_t word = 0;
  int free = -1, pending = 0;
  for (int i = 0; i < kMailboxes; ++i) {
    const Mailbox& one = mailboxes_[static_cast<std::size_t>(i)];
    word |= (one.result | (one.abort ? 0x80U : 0U)) << 8 * i;
    if (one.pending) {
      ++pending;
    } else {
      word |= reg::tsr::kTme0.mask() << i;
      if (free < 0) free = i;
    }
  }
  if (pending > 1) word |= reg::tsr::kLow0.mask() << lowest_priority();
  return word | reg::tsr::kCode(static_cast<std::uint32_t>(free >= 0 ? free : lowest_priority()));
}

std::uint32_t Can::esr() const {
  return reg::esr::kEwgf(tec_ >= 96 || rec_ >= 96 ? 1 : 0) | reg::esr::kEpvf(error_passive() ? 1 : 0) |
         reg::esr::kBoff(bus_off_ ? 1 : 0) | reg::esr::kLec(lec_) |
         reg::esr::kTec(static_cast<std::uint32_t>(std::min(tec_, 255))) |
         reg::esr::kRec(static_cast<std::uint32_t>(std::min(rec_, 255)));
}

std::uint32_t Can::read_fifo(int fifo, std::uint32_t word) const {
  const auto& frames = fifos_[static_cast<std::size_t>(fifo)].frames;
  if (frames.empty()) return 0;
  const Stored& first = frames.front();
  const base::CanFrame& frame = first.frame.frame;
  std::uint32_t data[2];
  std::memcpy(data, frame.data.data(), 8);
  switch (word) {
    case 0:
      return (frame.extended ? frame.id << 3 | 4U : frame.id << 21) | (first.frame.remote ? 2U : 0U);
    case 1:
      return reg::rdtxr::kDlc(frame.size) | reg::rdtxr::kFmi(static_cast<std::uint32_t>(first.match));
    default:
      return data[word - 2];
  }
}

std::uint32_t Can::read_mailbox(std::uint32_t offset) const {
  const std::uint32_t index = (offset - reg::tixr::kOffset) / reg::tixr::kStride;
  const Mailbox& one = mailboxes_[index];
  switch (offset & 0xC) {
    case 0:
      return one.ir | (one.pending ? 1U : 0U);
    case 4:
      return one.dtr;
    case 8:
      return one.dlr;
    default:
      return one.dhr;
  }
}

std::uint32_t Can::read(std::uint32_t offset) {
  if (offset >= reg::fmr::kOffset) return filters_.read(offset);
  if (offset >= reg::rixr::kOffset) {
    const std::uint32_t fifo = (offset - reg::rixr::kOffset) / reg::rixr::kStride;
    return fifo < 2 ? read_fifo(static_cast<int>(fifo), (offset & 0xC) / 4) : 0;
  }
  if (offset >= reg::tixr::kOffset) return read_mailbox(offset);
  const auto state = [](const Fifo& fifo) {
    return static_cast<std::uint32_t>(fifo.frames.size()) | (fifo.full ? 8U : 0U) | (fifo.overrun ? 16U : 0U);
  };
  switch (offset) {
    case reg::mcr::kOffset:
      return mcr_;
    case reg::msr::kOffset:
      return msr();
    case reg::tsr::kOffset:
      return tsr();
    case reg::rf0r::kOffset:
      return state(fifos_[0]);
    case reg::rf1r::kOffset:
      return state(fifos_[1]);
    case reg::ier::kOffset:
      return ier_;
    case reg::esr::kOffset:
      return esr();
    case reg::btr::kOffset:
      return btr_;
    default:
      return 0;
  }
}

void Can::write(std::uint32_t offset, std::uint32_t value, std::uint32_t mask) {
  value &= mask;
  if (offset >= reg::fmr::kOffset) {
    const char* complaint = filters_.write(offset, value);
    if (complaint != nullptr) complain(complaint);
    return;
  }
  if (offset >= reg::rixr::kOffset) return complain("receive mailbox written: it is read-only");
  if (offset >= reg::tixr::kOffset) return write_mailbox(offset, value, mask);
  switch (offset) {
    case reg::mcr::kOffset:
      write_mcr(value);
      break;
    case reg::msr::kOffset:
      if (reg::msr::kErri.of(value) != 0) erri_ = false;
      break;
    case reg::tsr::kOffset:
      write_tsr(value);
      break;
    case reg::rf0r::kOffset:
      write_fifo(fifos_[0], value);
      break;
    case reg::rf1r::kOffset:
      write_fifo(fifos_[1], value);
      break;
    case reg::ier::kOffset:
      ier_ = value;
      break;
    case reg::esr::kOffset:
      lec_ = reg::esr::kLec.of(value);
      break;
    case reg::btr::kOffset:
      if (mode_ != Mode::kInitialisation) return complain("BTR written outside of initialisation mode: ignored");
      btr_ = value;
      break;
    default:
      break;
  }
  update();
}

void Can::write_mcr(std::uint32_t value) {
  if (reg::mcr::kReset.of(value) != 0) return reset();
  const std::uint32_t changed = mcr_ ^ value;
  mcr_ = value;
  if ((changed & (reg::mcr::kInrq.mask() | reg::mcr::kSleep.mask())) != 0) change_mode();
}

void Can::change_mode() {
  const bool init_requested = reg::mcr::kInrq.of(mcr_) != 0, sleep_requested = reg::mcr::kSleep.of(mcr_) != 0;
  if (!init_requested && !sleep_requested && mode_ != Mode::kNormal) {
    if (!pins_.carries(kRx, Signal::kCan1Rx)) {
      mode_change_.clear();
      return complain("CAN1_RX never sees eleven recessive bits: " + pins_.describe(kRx));
    }
    if (!pins_.carries(kTx, Signal::kCan1Tx)) complain("CAN1_TX does not reach the bus: " + pins_.describe(kTx));
    if (line.stuck_dominant) return mode_change_.clear();
    const Picoseconds quiet = std::max(now(), line.disturbed_until());
    return mode_change_.set(quiet + periods(kSynchronise, std::max<std::int64_t>(bit_rate(), 1)));
  }
  mode_change_.set(now() + kModeChange);
}

void Can::mode_reached() {
  if (mode_ == Mode::kNormal && sending_ >= 0 && line.busy()) return mode_change_.set(now() + kModeChange);
  const Mode before = mode_;
  mode_ = reg::mcr::kInrq.of(mcr_) != 0    ? Mode::kInitialisation
          : reg::mcr::kSleep.of(mcr_) != 0 ? Mode::kSleep
                                           : Mode::kNormal;
  if (mode_ != Mode::kNormal) {
    recovery_.clear();
    recovers_ = false;
  }
  // RM0402, "Bus-Off recovery": with ABOM = 0 the sequence begins when initialisation mode is left.
  if (mode_ == Mode::kNormal && before != Mode::kNormal && bus_off_) {
    recovers_ = true;
    wait_for_recovery();
  }
  line.poke();
}

// A wait for recessive bits begins to count them.
void Can::released() {
  const std::uint32_t requests = reg::mcr::kInrq.mask() | reg::mcr::kSleep.mask();
  if (mode_ != Mode::kNormal && (mcr_ & requests) == 0) return change_mode();
  const bool asked = mode_ == Mode::kNormal && bus_off_ && !recovery_.pending();
  if (asked && (recovers_ || reg::mcr::kAbom.of(mcr_) != 0)) wait_for_recovery();
}

// Recovery needs 128 times 11 recessive bits, none of them while the bus is held.
void Can::wait_for_recovery() {
  const Picoseconds from = std::max(now(), line.disturbed_until());
  if (line.stuck_dominant) return;
  recovery_.set(from + periods(kRecovery, bit_rate()));
}

void Can::recovered() {
  bus_off_ = false;
  tec_ = rec_ = 0;
  lec_ = 0;
  line.poke();
  update();
}

void Can::enter_bus_off() {
  bus_off_ = true;
  recovers_ = false;
  sending_ = -1;
  if (reg::mcr::kAbom.of(mcr_) != 0) wait_for_recovery();
}

void Can::write_tsr(std::uint32_t value) {
  for (int i = 0; i < kMailboxes; ++i) {
    Mailbox& one = mailboxes_[static_cast<std::size_t>(i)];
    const std::uint32_t bits = value >> 8 * i & 0xFF;
    if ((bits & kRequestDone) != 0) one.result = 0;
    if ((bits & 0x80) != 0 && one.pending) {
      one.abort = true;
      if (sending_ != i) complete(one, kRequestDone);
    }
  }
}

void Can::write_fifo(Fifo& fifo, std::uint32_t value) {
  if ((value & 8) != 0) fifo.full = false;
  if ((value & 16) != 0) fifo.overrun = false;
  if ((value & 32) == 0) return;
  if (fifo.frames.empty()) return complain("RFOM set with an empty FIFO");
  fifo.frames.pop_front();
  fifo.full = false;
}

void Can::write_mailbox(std::uint32_t offset, std::uint32_t value, std::uint32_t mask) {
  const std::uint32_t index = (offset - reg::tixr::kOffset) / reg::tixr::kStride;
  Mailbox& one = mailboxes_[index];
  if (one.pending) return complain("transmit mailbox written while it is pending: ignored");
  switch (offset & 0xC) {
    case 0:
      merge(one.ir, value & ~1U, mask);
      if (reg::tixr::kTxrq.of(value) != 0) request(one);
      break;
    case 4:
      merge(one.dtr, value, mask);
      break;
    case 8:
      merge(one.dlr, value, mask);
      break;
    default:
      merge(one.dhr, value, mask);
      break;
  }
  update();
}

void Can::request(Mailbox& mailbox) {
  if (mode_ == Mode::kInitialisation || mode_ == Mode::kSleep) complain("TXRQ outside of normal mode");
  if (reg::tdtxr::kDlc.of(mailbox.dtr) > 8) complain("DLC above 8");
  mailbox.pending = true;
  mailbox.result = 0;
  mailbox.order = ++requests_;
  if (silent() && !loop_back()) complain("TXRQ in silent mode");
  if (loop_back() && silent()) {
    if (sending_ < 0 && offer()) loop_.set(now() + periods(frame_bits(frame_of(mailbox).frame, false), bit_rate()));
    return;
  }
  line.poke();
}

CanOffer Can::frame_of(const Mailbox& mailbox) {
  CanOffer offered;
  base::CanFrame& frame = offered.frame;
  frame.extended = reg::tixr::kIde.of(mailbox.ir) != 0;
  frame.id = frame.extended ? mailbox.ir >> 3 : mailbox.ir >> 21;
  offered.remote = reg::tixr::kRtr.of(mailbox.ir) != 0;
  frame.size = static_cast<std::uint8_t>(std::min(8U, reg::tdtxr::kDlc.of(mailbox.dtr)));
  const std::uint32_t data[2] = {mailbox.dlr, mailbox.dhr};
  std::memcpy(frame.data.data(), data, frame.size);
  return offered;
}

// RM0402, "Transmit priority": TXFP = 1 by the order of the requests, else by identifier, then by mailbox number.
int Can::next_mailbox() const {
  int best = -1;
  for (int i = 0; i < kMailboxes; ++i) {
    const Mailbox& one = mailboxes_[static_cast<std::size_t>(i)];
    if (!one.pending) continue;
    if (best < 0) {
      best = i;
      continue;
    }
    const Mailbox& other = mailboxes_[static_cast<std::size_t>(best)];
    const CanOffer a = frame_of(one), b = frame_of(other);
    const bool earlier = reg::mcr::kTxfp.of(mcr_) != 0
                             ? one.order < other.order
                             : arbitration_key(a.frame, a.remote) < arbitration_key(b.frame, b.remote);
    if (earlier) best = i;
  }
  return best;
}

int Can::lowest_priority() const {
  int lowest = 0;
  std::uint64_t worst = 0;
  for (int i = 0; i < kMailboxes; ++i) {
    const Mailbox& one = mailboxes_[static_cast<std::size_t>(i)];
    if (!one.pending) continue;
    const CanOffer frame = frame_of(one);
    const std::uint64_t key =
        reg::mcr::kTxfp.of(mcr_) != 0 ? one.order : arbitration_key(frame.frame, frame.remote) + 1;
    if (key >= worst) {
      worst = key;
      lowest = i;
    }
  }
  return lowest;
}

std::optional<CanOffer> Can::offer() {
  if (sending_ < 0 || !mailboxes_[static_cast<std::size_t>(sending_)].pending || !line.busy())
    sending_ = next_mailbox();
  if (sending_ < 0) return std::nullopt;
  return frame_of(mailboxes_[static_cast<std::size_t>(sending_)]);
}

void Can::complete(Mailbox& mailbox, std::uint32_t result) {
  mailbox.pending = mailbox.abort = false;
  mailbox.result = result;
  update();
}

void Can::sent() {
  if (sending_ < 0) return;
  Mailbox& one = mailboxes_[static_cast<std::size_t>(sending_)];
  const CanOffer frame = frame_of(one);
  sending_ = -1;
  tec_ = std::max(0, tec_ - 1);
  lec_ = 0;
  complete(one, kRequestDone | kSentOk);
  if (loop_back()) store(frame);
  if (loop_back() && silent()) {
    const auto next = offer();
    if (next) loop_.set(now() + periods(frame_bits(next->frame, next->remote), bit_rate()));
  }
}

void Can::lost_arbitration() {
  Mailbox& one = mailboxes_[static_cast<std::size_t>(sending_)];
  sending_ = -1;
  one.result |= kArbitrationLost;
  if (reg::mcr::kNart.of(mcr_) != 0 || one.abort) complete(one, kRequestDone | kArbitrationLost);
}

// Fault confinement, ISO 11898-1: a transmit error costs 8; a missing acknowledgement costs nothing once error passive.
void Can::failed(CanError error) {
  Mailbox& one = mailboxes_[static_cast<std::size_t>(sending_)];
  sending_ = -1;
  if (error != CanError::kAck || !error_passive()) tec_ += 8;
  one.result |= kTransmitError;
  set_error(static_cast<std::uint32_t>(error));
  if (tec_ > 255) enter_bus_off();
  if (reg::mcr::kNart.of(mcr_) != 0 || one.abort) complete(one, kRequestDone | kTransmitError);
  update();
}

void Can::receive_error(CanError error) {
  if (silent()) return;
  rec_ = std::min(rec_ + 1, 255);
  set_error(static_cast<std::uint32_t>(error));
  update();
}

void Can::set_error(std::uint32_t code) { lec_ = code; }

void Can::received(const CanOffer& frame) {
  rec_ = rec_ > 127 ? 120 : std::max(0, rec_ - 1);
  lec_ = 0;
  store(frame);
}

void Can::store(const CanOffer& frame) {
  const auto match = filters_.match(frame);
  if (!match) return;
  Fifo& fifo = fifos_[static_cast<std::size_t>(match->fifo)];
  if (fifo.frames.size() == kFifoDepth) {
    fifo.overrun = true;  // RFLM = 0: the last frame is overwritten; 1: the new one is lost
    if (reg::mcr::kRflm.of(mcr_) == 0) fifo.frames.back() = {frame, match->index};
  } else {
    fifo.frames.push_back({frame, match->index});
  }
  fifo.full = fifo.full || fifo.frames.size() == kFifoDepth;
  update();
}

void Can::update() {
  const std::uint32_t errors = esr();
  const bool error = (reg::ier::kEwgie.of(ier_) != 0 && reg::esr::kEwgf.of(errors) != 0) ||
                     (reg::ier::kEpvie.of(ier_) != 0 && reg::esr::kEpvf.of(errors) != 0) ||
                     (reg::ier::kBofie.of(ier_) != 0 && reg::esr::kBoff.of(errors) != 0) ||
                     (reg::ier::kLecie.of(ier_) != 0 && lec_ != 0 && lec_ != 7);
  static_assert(reg::esr::kLec.width == 3);
  if (error && !error_seen_) erri_ = true;  // set by the event, cleared by software
  error_seen_ = error;
  set_interrupt(irq::kCan1Sce, erri_ && reg::ier::kErrie.of(ier_) != 0);
  bool done = false;
  for (const Mailbox& one : mailboxes_) done = done || (one.result & kRequestDone) != 0;
  set_interrupt(irq::kCan1Tx, done && reg::ier::kTmeie.of(ier_) != 0);
  const auto fifo_level = [](const Fifo& fifo, std::uint32_t enables) {
    return ((enables & 1) != 0 && !fifo.frames.empty()) || ((enables & 2) != 0 && fifo.full) ||
           ((enables & 4) != 0 && fifo.overrun);
  };
  set_interrupt(irq::kCan1Rx0, fifo_level(fifos_[0], ier_ >> 1 & 7));
  set_interrupt(irq::kCan1Rx1, fifo_level(fifos_[1], ier_ >> 4 & 7));
}

}  // namespace tetap::board
