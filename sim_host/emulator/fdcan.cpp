// SPDX-License-Identifier: Apache-2.0
#include "sim_host/emulator/fdcan.hpp"

#include "hal/chip/stm32/registers_stm32g474.hpp"

#include <algorithm>
#include <cstring>

namespace tetap::board {

namespace reg = hal::stm32g474::fdcan;
namespace irq = hal::stm32g474::interrupt;

namespace {

constexpr Picoseconds kInitDelay = kMicrosecond / 2;    // crosses two clock domains; the manual gives no number
constexpr int kSynchronise = 11;                        // recessive bits before a node takes part
constexpr std::int64_t kRecovery = 129 * 11;            // RM0440, "Bus_Off": recessive bits before it ends
constexpr std::uint32_t kNoChange = 7, kBit0Error = 5;  // PSR.LEC
constexpr std::uint32_t kBuffers = (1U << fdcan_ram::kDepth) - 1;

// Words of elements, RM0440 sections "FDCAN Rx buffer and FIFO element", "FDCAN Tx buffer element", "Tx event FIFO".
constexpr hal::Field kXtd{30, 1}, kRtr{29, 1}, kStandardId{18, 11}, kExtendedId{0, 29};
constexpr hal::Field kMarker{24, 8}, kEventWanted{23, 1}, kFdf{21, 1}, kBrs{20, 1}, kDlc{16, 4};
constexpr hal::Field kAnmf{31, 1}, kFidx{24, 7}, kEventType{22, 2};

namespace cccr = reg::cccr;
namespace ir = reg::ir;

/// Bits of CCCR that need INIT and CCE.
constexpr std::uint32_t kProtected = cccr::kAsm.mask() | cccr::kMon.mask() | cccr::kDar.mask() | cccr::kTest.mask() |
                                     cccr::kFdoe.mask() | cccr::kBrse.mask() | cccr::kPxhd.mask() | cccr::kEfbi.mask() |
                                     cccr::kTxp.mask() | cccr::kNiso.mask();

/// Flags of IR by the groups of ILS.
struct Group {
  std::uint32_t select, flags;
};
constexpr Group kGroups[] = {
    {reg::ils::kRxfifo0.mask(), ir::kRf0n.mask() | ir::kRf0f.mask() | ir::kRf0l.mask()},
    {reg::ils::kRxfifo1.mask(), ir::kRf1n.mask() | ir::kRf1f.mask() | ir::kRf1l.mask()},
    {reg::ils::kSmsg.mask(), ir::kHpm.mask() | ir::kTc.mask() | ir::kTcf.mask()},
    {reg::ils::kTferr.mask(), ir::kTfe.mask() | ir::kTefn.mask() | ir::kTeff.mask() | ir::kTefl.mask()},
    {reg::ils::kMisc.mask(), ir::kTsw.mask() | ir::kMraf.mask() | ir::kToo.mask()},
    {reg::ils::kBerr.mask(), ir::kElo.mask() | ir::kEp.mask()},
    {reg::ils::kPerr.mask(),
     ir::kEw.mask() | ir::kBo.mask() | ir::kWdi.mask() | ir::kPea.mask() | ir::kPed.mask() | ir::kAra.mask()},
};

constexpr std::uint32_t tx_word(std::uint32_t buffer) { return fdcan_ram::kTx + buffer * fdcan_ram::kElement; }

}  // namespace

Fdcan::Fdcan(Surroundings around, FdcanRam& ram, const Pins& pins, Wiring wiring,
             std::function<std::int64_t()> kernel_hz, std::function<std::int64_t()> bus_hz)
    : Peripheral(around, "FDCAN1", reg::kFdcan1, kWords),
      line(around.scheduler, *this),
      ram_(ram),
      pins_(pins),
      wiring_(wiring),
      kernel_hz_(std::move(kernel_hz)),
      bus_hz_(std::move(bus_hz)),
      init_change_(around.scheduler, [this] { init_reached(); }),
      join_(around.scheduler, [this] { joined(); }) {
  ram_.guard = [this](std::uint32_t word, bool write) { return wrong_access(word, write); };
  reset();
}

void Fdcan::reset() {
  cccr_ = cccr::kResetValue;
  nbtp_ = reg::nbtp::kResetValue;
  dbtp_ = reg::dbtp::kResetValue;
  xidam_ = reg::xidam::kResetValue;
  rxgfc_ = tscc_ = ckdiv_ = txbc_ = ir_ = ie_ = ils_ = ile_ = txbtie_ = txbcie_ = 0;
  lec_ = kNoChange;
  errors_logged_ = 0;
  state_ = State::kInitialisation;
  wanted_init_ = true;
  bus_off_ = passive_seen_ = warning_seen_ = false;
  tec_ = rec_ = 0;
  init_change_.clear();
  join_.clear();
  clear_by_cce();
  update();
}

bool Fdcan::initialising() const { return cccr::kInit.of(cccr_) != 0; }
bool Fdcan::configurable() const { return initialising() && cccr::kCce.of(cccr_) != 0; }
bool Fdcan::queue_mode() const { return reg::txbc::kTfqm.of(txbc_) != 0; }

std::int64_t Fdcan::bit_rate() const {
  const std::int64_t quanta = 3 + std::int64_t{reg::nbtp::kNtseg1.of(nbtp_)} + reg::nbtp::kNtseg2.of(nbtp_);
  const std::int64_t kernel = kernel_hz_() / (ckdiv_ == 0 ? 1 : 2 * std::int64_t{ckdiv_});
  return std::max<std::int64_t>(kernel / (std::int64_t{reg::nbtp::kNbrp.of(nbtp_)} + 1) / quanta, 1);
}

double Fdcan::rate_tolerance() const {
  return rate_tolerance_of(reg::nbtp::kNtseg1.of(nbtp_) + 1.0, reg::nbtp::kNtseg2.of(nbtp_) + 1.0,
                           reg::nbtp::kNsjw.of(nbtp_) + 1.0);
}

// RM0440, "Software initialization": CCE is set only where INIT reads 1, and falls with it.
void Fdcan::write_cccr(std::uint32_t value) {
  const bool was_init = initialising(), was_configurable = configurable();
  if (cccr::kCce.of(value) != 0 && !was_init) {
    complain("CCE set while INIT reads 0: ignored");
    value &= ~cccr::kCce.mask();
  }
  const std::uint32_t changed = (cccr_ ^ value) & kProtected;
  if (changed != 0 && !was_configurable) {
    // MON and TEST may be taken back at any time.
    if ((changed & ~((cccr::kMon.mask() | cccr::kTest.mask()) & ~value)) != 0)
      complain("mode bits of CCCR written without CCE: ignored");
    value = (value & ~kProtected) | (cccr_ & kProtected);
  }
  if ((value & (cccr::kTest.mask() | cccr::kAsm.mask() | cccr::kCsr.mask() | cccr::kTxp.mask())) != 0)
    complain("CCCR: test and restricted mode, clock stop and transmit pause are not modelled");
  if (cccr::kFdoe.of(value) != 0) complain("CCCR.FDOE: frames with flexible data rate are not modelled");
  const bool init = cccr::kInit.of(value) != 0;
  cccr_ = cccr::kInit.in(value, was_init ? 1 : 0);
  if (configurable() && !was_configurable) clear_by_cce();
  write_init(init);
}

// The value that was written is read back later; until then INIT is not written anew.
void Fdcan::write_init(bool init) {
  if (init == wanted_init_) return;
  if (init_change_.pending()) complain("INIT changed before its last value is read back");
  wanted_init_ = init;
  if (!init) cccr_ &= ~cccr::kCce.mask();
  init_change_.set(now() + kInitDelay);
}

void Fdcan::init_reached() {
  if (wanted_init_ && line.busy() && sending_ >= 0) return init_change_.set(now() + kInitDelay);
  cccr_ = cccr::kInit.in(cccr_, wanted_init_ ? 1 : 0);
  if (wanted_init_) {
    state_ = State::kInitialisation;
    sending_ = -1;
    join_.clear();
  } else {
    leave_initialisation();
  }
  line.poke();
}

void Fdcan::check_timing() const {
  if (kernel_hz_() == 0) complain("INIT cleared, but the clock that RCC_CCIPR.FDCANSEL selects does not run");
  if (kernel_hz_() > bus_hz_()) complain("kernel clock above the clock of the APB");
  const std::uint32_t segment2 = reg::nbtp::kNtseg2.of(nbtp_) + 1, jump = reg::nbtp::kNsjw.of(nbtp_) + 1;
  if (jump > segment2) complain("NBTP: the jump width is longer than segment 2");
  if (reg::nbtp::kNtseg1.of(nbtp_) == 0) complain("NBTP: NTSEG1 of 0 is not allowed");
}

void Fdcan::check_start() const {
  check_timing();
  for (std::uint32_t i = 0; i < standard_filters(rxgfc_); ++i) {
    if (!ram_.written(fdcan_ram::kStandard + i)) complain("RXGFC.LSS reaches filters that were never written");
  }
  for (std::uint32_t i = 0; i < 2 * extended_filters(rxgfc_); ++i) {
    if (!ram_.written(fdcan_ram::kExtended + i)) complain("RXGFC.LSE reaches filters that were never written");
  }
  if (reg::rxgfc::kLss.of(rxgfc_) > fdcan_ram::kStandardFilters) complain("RXGFC.LSS above 28");
  if (reg::rxgfc::kLse.of(rxgfc_) > fdcan_ram::kExtendedFilters) complain("RXGFC.LSE above 8");
}

void Fdcan::leave_initialisation() {
  check_start();
  if (!pins_.carries(wiring_.tx, Signal::kFdcan1Tx))
    complain("FDCAN1_TX does not reach the bus: " + pins_.describe(wiring_.tx));
  state_ = bus_off_ ? State::kRecovering : State::kSynchronising;
  if (!pins_.carries(wiring_.rx, Signal::kFdcan1Rx)) {
    return complain("FDCAN1_RX never sees eleven recessive bits: " + pins_.describe(wiring_.rx));
  }
  wait_for_bus();
}

// None of the recessive bits comes while the bus is held or disturbed.
void Fdcan::wait_for_bus() {
  recovery_since_ = std::max(now(), line.disturbed_until());
  if (kernel_hz_() == 0) return;
  if (line.stuck_dominant) return join_.clear();
  join_.set(recovery_since_ + periods(bus_off_ ? kRecovery : kSynchronise, bit_rate()));
}

void Fdcan::released() {
  if (state_ == State::kSynchronising || state_ == State::kRecovering) wait_for_bus();
}

void Fdcan::joined() {
  const std::int64_t bits = bus_off_ ? kRecovery : kSynchronise;
  const bool broken = line.stuck_dominant || line.disturbed_until() > recovery_since_;
  if (broken || now() < recovery_since_ + periods(bits, bit_rate())) return wait_for_bus();
  state_ = State::kActive;
  if (bus_off_) {
    bus_off_ = false;
    tec_ = rec_ = 0;
    raise(ir::kBo.mask());
    update_errors();
  }
  line.poke();
  update();
}

// RM0440, "Bus_Off": the controller sets INIT and does nothing until software clears it. Requests stay pending.
void Fdcan::enter_bus_off() {
  bus_off_ = true;
  sending_ = -1;
  state_ = State::kInitialisation;
  wanted_init_ = true;
  cccr_ |= cccr::kInit.mask();
  init_change_.clear();
  join_.clear();
  raise(ir::kBo.mask());
}

// RM0440, "Software initialization": what CCE = 1 resets.
void Fdcan::clear_by_cce() {
  hpms_ = txbrp_ = txbto_ = txbcf_ = cancelled_ = 0;
  rx_ = {};
  tx_ = events_ = {};
  sending_ = -1;
}

std::uint32_t Fdcan::txfqs() const {
  namespace bits = reg::txfqs;
  if (!queue_mode()) {
    return bits::kTffl(kDepth - tx_.fill) | bits::kTfgi(tx_.get) | bits::kTfqpi(tx_.put()) |
           bits::kTfqf(tx_.fill == kDepth ? 1 : 0);
  }
  for (std::uint32_t i = 0; i < kDepth; ++i) {
    if ((txbrp_ >> i & 1) == 0) return bits::kTfqpi(i);
  }
  return bits::kTfqf(1);
}

CanOffer Fdcan::frame_of(std::uint32_t buffer) const {
  const std::uint32_t t0 = ram_.at(tx_word(buffer)), t1 = ram_.at(tx_word(buffer) + 1);
  CanOffer offered;
  base::CanFrame& frame = offered.frame;
  frame.extended = kXtd.of(t0) != 0;
  frame.id = frame.extended ? kExtendedId.of(t0) : kStandardId.of(t0);
  offered.remote = kRtr.of(t0) != 0;
  frame.size = static_cast<std::uint8_t>(std::min(8U, kDlc.of(t1)));
  const std::uint32_t data[2] = {ram_.at(tx_word(buffer) + 2), ram_.at(tx_word(buffer) + 3)};
  std::memcpy(frame.data.data(), data, frame.size);
  return offered;
}

// RM0440, "Tx FIFO" and "Tx queue": by the order of the requests, or by identifier and then by buffer number.
int Fdcan::next_buffer() const {
  if (!queue_mode()) return tx_.fill != 0 && (txbrp_ >> tx_.get & 1) != 0 ? static_cast<int>(tx_.get) : -1;
  int best = -1;
  std::uint64_t best_key = 0;
  for (std::uint32_t i = 0; i < kDepth; ++i) {
    if ((txbrp_ >> i & 1) == 0) continue;
    const CanOffer frame = frame_of(i);
    const std::uint64_t key = arbitration_key(frame.frame, frame.remote);
    if (best >= 0 && key >= best_key) continue;
    best = static_cast<int>(i);
    best_key = key;
  }
  return best;
}

void Fdcan::request_one(std::uint32_t buffer) {
  const std::uint32_t t1 = ram_.at(tx_word(buffer) + 1);
  if (!ram_.written(tx_word(buffer)) || !ram_.written(tx_word(buffer) + 1))
    complain("TXBAR for a buffer that was never written");
  if (kDlc.of(t1) > 8) complain("DLC above 8 in a classic frame");
  if (kFdf.of(t1) != 0 || kBrs.of(t1) != 0) complain("FDF or BRS in a buffer: FDOE is off");
  txbrp_ |= 1U << buffer;
  txbto_ &= ~(1U << buffer);
  txbcf_ &= ~(1U << buffer);
  cancelled_ &= ~(1U << buffer);
  if (!queue_mode()) ++tx_.fill;
}

void Fdcan::request(std::uint32_t bits) {
  bits &= kBuffers;
  if (configurable()) return complain("TXBAR written with CCE = 1: lost");
  if (cccr::kMon.of(cccr_) != 0) complain("TXBAR in bus monitoring mode");
  if ((bits & txbrp_) != 0) {
    complain("TXBAR for a buffer that is pending: ignored");
    bits &= ~txbrp_;
  }
  if (queue_mode()) {
    for (std::uint32_t i = 0; i < kDepth; ++i) {
      if ((bits >> i & 1) != 0) request_one(i);
    }
  } else {
    while (bits != 0) {
      const std::uint32_t buffer = tx_.put();
      if (tx_.fill == kDepth || (bits >> buffer & 1) == 0) {
        complain("TXBAR for a buffer that is not at the put index of the FIFO: ignored");
        break;
      }
      bits &= ~(1U << buffer);
      request_one(buffer);
    }
  }
  line.poke();
}

// RM0440, "Transmit cancellation": a frame on the wire is finished first.
void Fdcan::cancel(std::uint32_t bits) {
  for (std::uint32_t i = 0; i < kDepth; ++i) {
    if ((bits & txbrp_ & 1U << i) == 0) continue;
    cancelled_ |= 1U << i;
    if (sending_ != static_cast<int>(i) || !line.busy()) finish(i, false);
  }
}

// A buffer's request ends: sent, or taken back. The get index goes on to the next pending one.
void Fdcan::finish(std::uint32_t buffer, bool transmitted) {
  const std::uint32_t bit = 1U << buffer;
  txbrp_ &= ~bit;
  if (transmitted) txbto_ |= bit;
  if (!transmitted || (cancelled_ & bit) != 0) txbcf_ |= bit;
  if (transmitted && (txbtie_ & bit) != 0) raise(ir::kTc.mask());
  if ((txbcf_ & bit) != 0 && (txbcie_ & bit) != 0) raise(ir::kTcf.mask());
  cancelled_ &= ~bit;
  if (sending_ == static_cast<int>(buffer)) sending_ = -1;
  const bool was_filled = queue_mode() ? true : tx_.fill != 0;
  while (!queue_mode() && tx_.fill != 0 && (txbrp_ >> tx_.get & 1) == 0) {
    tx_.get = (tx_.get + 1) % kDepth;
    --tx_.fill;
  }
  if (was_filled && txbrp_ == 0) raise(ir::kTfe.mask());
  update();
}

void Fdcan::store_event(std::uint32_t buffer) {
  const std::uint32_t t0 = ram_.at(tx_word(buffer)), t1 = ram_.at(tx_word(buffer) + 1);
  if (kEventWanted.of(t1) == 0) return;
  if (events_.fill == kDepth) return raise(ir::kTefl.mask());
  const std::uint32_t at = fdcan_ram::kEvents + events_.put() * fdcan_ram::kEvent;
  const bool in_spite = (cancelled_ >> buffer & 1) != 0 || cccr::kDar.of(cccr_) != 0;
  ram_.put(at, t0);
  ram_.put(at + 1,
           kMarker(kMarker.of(t1)) | kEventType(in_spite ? 2 : 1) | kDlc(kDlc.of(t1)) | start_stamp(frame_of(buffer)));
  ++events_.fill;
  raise(ir::kTefn.mask() | (events_.fill == kDepth ? ir::kTeff.mask() : 0));
}

std::optional<CanOffer> Fdcan::offer() {
  const bool pending = sending_ >= 0 && (txbrp_ >> sending_ & 1) != 0;
  if (!pending || !line.busy()) sending_ = cccr::kMon.of(cccr_) != 0 ? -1 : next_buffer();
  if (sending_ < 0) return std::nullopt;
  return frame_of(static_cast<std::uint32_t>(sending_));
}

void Fdcan::sent() {
  if (sending_ < 0) return;
  const auto buffer = static_cast<std::uint32_t>(sending_);
  tec_ = std::max(0, tec_ - 1);
  lec_ = 0;
  store_event(buffer);
  finish(buffer, true);
  update_errors();
}

void Fdcan::lost_arbitration() {
  const auto buffer = static_cast<std::uint32_t>(sending_);
  sending_ = -1;
  if (cccr::kDar.of(cccr_) != 0 || (cancelled_ >> buffer & 1) != 0) finish(buffer, false);
}

// Fault confinement, ISO 11898-1: a transmit error costs 8; a missing acknowledgement costs nothing once error passive.
void Fdcan::failed(CanError error) {
  const auto buffer = static_cast<std::uint32_t>(sending_);
  sending_ = -1;
  if (error != CanError::kAck || !error_passive()) {
    tec_ += 8;
    ++errors_logged_;
  }
  set_error(static_cast<std::uint32_t>(error));
  if (tec_ > 255) enter_bus_off();
  if (cccr::kDar.of(cccr_) != 0 || (cancelled_ >> buffer & 1) != 0) finish(buffer, false);
  update_errors();
}

void Fdcan::receive_error(CanError error) {
  rec_ = std::min(rec_ + 1, 128);
  ++errors_logged_;
  set_error(static_cast<std::uint32_t>(error));
  update_errors();
}

void Fdcan::set_error(std::uint32_t code) {
  lec_ = code;
  raise(ir::kPea.mask());
}

void Fdcan::update_errors() {
  const bool warning = tec_ >= 96 || rec_ >= 96;
  std::uint32_t flags = 0;
  if (warning != warning_seen_) flags |= ir::kEw.mask();
  if (error_passive() != passive_seen_) flags |= ir::kEp.mask();
  warning_seen_ = warning;
  passive_seen_ = error_passive();
  raise(flags);
}

void Fdcan::received(const CanOffer& frame) {
  rec_ = rec_ > 127 ? 120 : std::max(0, rec_ - 1);
  lec_ = 0;
  store(frame);
  update_errors();
}

void Fdcan::store(const CanOffer& frame) {
  const FdcanMatch match = match_filters(ram_, {rxgfc_, xidam_}, frame);
  if (match.priority) {
    raise(ir::kHpm.mask());
    const bool stored = match.fifo >= 0;
    hpms_ = reg::hpms::kFidx(static_cast<std::uint32_t>(match.index)) | reg::hpms::kFlst(frame.frame.extended ? 1 : 0) |
            (stored ? reg::hpms::kMsi(static_cast<std::uint32_t>(2 + match.fifo)) |
                          reg::hpms::kBidx(rx_[static_cast<std::size_t>(match.fifo)].put())
                    : 0);
  }
  if (match.fifo < 0) return;
  Fifo& fifo = rx_[static_cast<std::size_t>(match.fifo)];
  const int shift = match.fifo == 0 ? 0 : ir::kRf1n.lsb - ir::kRf0n.lsb;
  const bool overwrites = (match.fifo == 0 ? reg::rxgfc::kF0om : reg::rxgfc::kF1om).of(rxgfc_) != 0;
  if (fifo.fill == kDepth && !overwrites) return raise(ir::kRf0l.mask() << shift);  // blocking: the new frame is lost
  if (fifo.fill == kDepth) {
    fifo.get = (fifo.get + 1) % kDepth;
    --fifo.fill;
  }
  const std::uint32_t base = match.fifo == 0 ? fdcan_ram::kRx0 : fdcan_ram::kRx1;
  put_element(base + fifo.put() * fdcan_ram::kElement, frame, match);
  ++fifo.fill;
  raise((ir::kRf0n.mask() | (fifo.fill == kDepth ? ir::kRf0f.mask() : 0)) << shift);
}

void Fdcan::put_element(std::uint32_t base, const CanOffer& frame, const FdcanMatch& match) {
  const base::CanFrame& one = frame.frame;
  std::uint32_t data[2];
  std::memcpy(data, one.data.data(), 8);
  ram_.put(base, (one.extended ? kXtd(1) | kExtendedId(one.id) : kStandardId(one.id)) | kRtr(frame.remote ? 1 : 0));
  ram_.put(base + 1, kAnmf(match.matched ? 0 : 1) | kFidx(static_cast<std::uint32_t>(match.index)) | kDlc(one.size) |
                         start_stamp(frame));
  for (std::uint32_t i = 0; i < 2 && 4 * i < one.size; ++i) ram_.put(base + 2 + i, data[i]);
}

std::uint32_t Fdcan::status_of(const Fifo& fifo, std::uint32_t lost_flag) const {
  namespace bits = reg::rxf0s;
  return bits::kF0fl(fifo.fill) | bits::kF0gi(fifo.get) | bits::kF0pi(fifo.put()) |
         bits::kF0f(fifo.fill == kDepth ? 1 : 0) | bits::kRf0l((ir_ & lost_flag) != 0 ? 1 : 0);
}

// RM0440, "FIFO acknowledge handling": the element that is named and those before it become free.
void Fdcan::acknowledge(Fifo& fifo, std::uint32_t index, const char* name) {
  if (index >= kDepth || !fifo.holds(index)) {
    return complain(std::string(name) + " acknowledged at index " + std::to_string(index) + ", which holds nothing");
  }
  const std::uint32_t count = (index + kDepth - fifo.get) % kDepth + 1;
  fifo.get = (index + 1) % kDepth;
  fifo.fill -= count;
}

// The program may write everything while INIT is set, and reads what was handed over; the rest belongs to the
// controller.
const char* Fdcan::wrong_access(std::uint32_t word, bool write) const {
  if (word >= fdcan_ram::kTx) {
    const std::uint32_t buffer = (word - fdcan_ram::kTx) / fdcan_ram::kElement;
    return write && (txbrp_ >> buffer & 1) != 0 ? "transmit buffer written while its request is pending" : nullptr;
  }
  if (initialising() || word < fdcan_ram::kRx0) return nullptr;
  if (write) return "receive or event FIFO written by the program";
  const bool event = word >= fdcan_ram::kEvents, second = word >= fdcan_ram::kRx1;
  const std::uint32_t base = event ? fdcan_ram::kEvents : second ? fdcan_ram::kRx1 : fdcan_ram::kRx0;
  const std::uint32_t index = (word - base) / (event ? fdcan_ram::kEvent : fdcan_ram::kElement);
  const Fifo& fifo = event ? events_ : rx_[second ? 1 : 0];
  return fifo.holds(index) ? nullptr : "element of a FIFO read that holds nothing";
}

std::uint32_t Fdcan::psr() const {
  namespace bits = reg::psr;
  std::uint32_t activity = state_ == State::kActive ? 1 : 0;
  if (state_ == State::kActive && line.busy()) activity = sending_ >= 0 ? 3 : 2;
  const bool counting = state_ == State::kRecovering && !line.stuck_dominant && !line.disturbed();
  return bits::kLec(counting ? kBit0Error : lec_) | bits::kAct(activity) | bits::kEp(error_passive() ? 1 : 0) |
         bits::kEw(warning_seen_ ? 1 : 0) | bits::kBo(bus_off_ ? 1 : 0) | bits::kDlec(kNoChange);
}

// While the bus-off recovery runs, REC counts the sequences of eleven recessive bits.
std::uint32_t Fdcan::ecr() const {
  namespace bits = reg::ecr;
  auto rec = static_cast<std::uint32_t>(std::min(rec_, 127));
  if (state_ == State::kRecovering && now() > recovery_since_)
    rec = static_cast<std::uint32_t>(std::min<std::int64_t>((now() - recovery_since_) / periods(11, bit_rate()), 127));
  return bits::kTec(static_cast<std::uint32_t>(std::min(tec_, 255))) | bits::kRec(rec) | bits::kRp(rec_ > 127 ? 1 : 0) |
         bits::kCel(std::min(errors_logged_, 255U));
}

// RM0440, FDCAN_TSCC: TSS = 1 counts bit times, divided by TCP + 1.
std::uint32_t Fdcan::timestamp(Picoseconds time) const {
  if (reg::tscc::kTss.of(tscc_) != 1) return 0;
  const Picoseconds count = periods(std::int64_t{reg::tscc::kTcp.of(tscc_)} + 1, bit_rate());
  return static_cast<std::uint32_t>((time - stamp_zero_) / count) & 0xFFFF;
}

// Stamps are taken at the start of a frame.
std::uint32_t Fdcan::start_stamp(const CanOffer& frame) const {
  return timestamp(std::max(stamp_zero_, now() - periods(frame_bits(frame.frame, frame.remote), bit_rate())));
}

void Fdcan::raise(std::uint32_t flags) {
  ir_ |= flags;
  update();
}

void Fdcan::update() {
  bool lines[2] = {false, false};
  for (const Group& group : kGroups) {
    if ((ir_ & ie_ & group.flags) != 0) lines[(ils_ & group.select) != 0 ? 1 : 0] = true;
  }
  set_interrupt(irq::kFdcan1It0, lines[0] && reg::ile::kEint0.of(ile_) != 0);
  set_interrupt(irq::kFdcan1It1, lines[1] && reg::ile::kEint1.of(ile_) != 0);
}

}  // namespace tetap::board
