// SPDX-License-Identifier: Apache-2.0
// The product: one object, one poll(). A port's main() is this object and a loop.
#pragma once

#include "hal/board.hpp"
#include "tetap/bus/frame_sink.hpp"
#include "tetap/bus/guard.hpp"
#include "tetap/bus/guard_sender.hpp"
#include "tetap/firmware/boot_self_check.hpp"
#include "tetap/firmware/canopen/adapter.hpp"
#include "tetap/firmware/kept_parameters.hpp"
#include "tetap/firmware/lockstep_policy.hpp"
#include "tetap/firmware/pacer.hpp"
#include "tetap/firmware/snapshot.hpp"
#include "tetap/firmware/wired_inputs.hpp"
#include "tetap/node/bus_protection.hpp"
#include "tetap/node/node.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>

namespace tetap::firmware {

/// `kParts`: the wired sensors that the image has drivers for, usually WiredParts::of(the robot's parameters).
template <hal::Board Board, class Estimators, WiredParts kParts = WiredParts{}>
class Firmware {
 public:
  Firmware(Board& board, const param::Parameters& parameters, const bus::Version& version)
      : board_(board),
        parameters_(parameters),
        node_(parameters, version),
        pacer_(base::Micros{parameters.loop.period_us}),
        extras_(board, parameters, version),
        canopen_(board, parameters, version, node_),
        kept_(board),
        end_(*this) {}

  /// Runs the exercise on this very node, then powers it on anew. For boot: the hash shows whether this core computes
  /// as all others do.
  [[nodiscard]] std::uint32_t self_check(std::uint32_t epochs) {
    bus::FrameHash hash(parameters_.can_base);
    bus::FrameSink frame_sink(can_end(), hash);
    BootSelfCheck(node_, parameters_.can_base, 1).run(epochs, frame_sink);
    node_.power_on({});
    node_.begin_claims();
    return hash.value();
  }

  /// Takes what has arrived and what wired sensors have measured, ticks when it is time, hands on what is to be sent.
  /// Call it in a loop, as often as you like: after the self-check, because the first call starts sensors and watchdog.
  /// A call ticks or begins once for a sync frame at most; frames behind that one wait for the next call.
  void poll() {
    if constexpr (hal::SensorBoard<Board>) {
      if (!polled_) board_.start_sensors();
    }
    if constexpr (kKeeps) {
      if (!polled_) load_parameters();
    }
    // As much as two full receivers: a bus that is never quiet must not keep the tick from its time.
    for (int i = 0; i < kMostPerPoll; ++i) {
      const auto frame = board_.can.receive();
      if (!frame || on_frame(*frame)) break;
    }
    if constexpr (kWired) poll_wired();
    if constexpr (kCanopen) poll_canopen();
    if (const auto t = pacer_.on_poll(board_.now(), health_)) tick(*t);
    board_.can.flush();
    end_poll();
  }

  /// Goes on from a snapshot's state; false: that is of another layout.
  [[nodiscard]] bool resume(std::span<const std::byte> state) requires hal::SnapshotBoard<Board> {
    const auto* const other = extras_.snapshot.load(state);
    if (other != nullptr) node_.resume(*other);
    return other != nullptr;
  }

 private:
  static constexpr int kMostPerPoll = 128;
  static constexpr std::uint32_t kInputs = 0x20;  ///< offsets below are inputs
  static constexpr bool kWired = WiredInputs<Board, kParts>::kAny;
  static constexpr bool kSnapshots = hal::SnapshotBoard<Board>;
  static constexpr bool kCanopen = node::kHasBusParameters<Estimators> && hal::CanopenBoard<Board>;
  /// A save outlives the power.
  static constexpr bool kKeeps = node::kHasBusParameters<Estimators> && hal::StorageBoard<Board>;
  using Node = node::Node<Estimators>;

  /// True: the node ticked or began.
  bool on_frame(const base::CanFrame& frame) {
    if constexpr (kCanopen) {
      if (canopen_.adapter.take(frame)) return false;
    }
    const std::uint32_t offset = frame.id - parameters_.can_base;
    if (frame.extended || offset >= bus::kBlock + bus::kMapBlock) return false;
    const bool own = is_own(offset);
    if (!own && Node::takes_map_input(static_cast<std::uint8_t>(offset))) return node_.on_frame(frame), false;
    if (!own && offset >= bus::kBlock) return false;
    // A frame that only this node sends, or may send now, comes from a second node of the same ids.
    if (own || offset >= kInputs) return conflict_ticks_ = 1'000'000 / parameters_.loop.period_us, false;
    if (offset == bus::InSync::kOffset) return on_sync(frame);
    if (bus::is_sync_guard(offset, frame)) return sync_guard_.announce(frame), false;
    return node_.on_frame(frame), false;
  }

  [[gnu::cold]] bool on_sync(const base::CanFrame& frame) {
    const auto sync = bus::decode<bus::InSync>(bus::payload(frame));
    if (!sync) return ++health_.sync_bad, false;
    const base::Micros time{static_cast<std::int64_t>(sync->time_us)};
    const bool begins = sync->kind == bus::SyncKind::kBegin;
    const SyncProof proof{.guarded = sync_guard_.covers(frame), .authenticated = node_.admits_sync(frame)};
    if (begins || sync->kind == bus::SyncKind::kStep) {
      if (!lockstep_.admits(sync->kind, proof, lockstep(), pacer_.state(), board_.now()))
        return ++health_.lock_refused, false;
    }
    count_sync(*sync);
    if (begins) {
      node_.power_on(time);
      health_.unlogged = false;
      bus::FrameSink frame_sink(can_end());
      node_.send_version(frame_sink);
    }
    // A desk's node is its player's: it takes a key as the robot did whose log is repeated.
    if ((begins || sync->kind == bus::SyncKind::kStep) && lockstep() != param::Lockstep::kPlain) node_.end_claims();
    const auto t = pacer_.on_sync(sync->kind, time, board_.now(), health_, proof.guarded || proof.authenticated);
    if (t) tick(*t);
    return begins || t.has_value();
  }

  [[nodiscard]] param::Lockstep lockstep() const {
    if constexpr (node::kHasBusParameters<Estimators>)
      return node_.parameter_sets().active().loop.lockstep;
    else
      return parameters_.loop.lockstep;
  }
  /// Counts sync frames that the counter skipped, modulo 256. A repeated frame is no gap, nor is one out of its order:
  /// its time is not later.
  void count_sync(const bus::InSync& sync) {
    const auto step = static_cast<std::uint8_t>(sync.ctr - sync_counter_);
    const bool anew = !counts_sync_ || sync.kind == bus::SyncKind::kBegin;
    if (!anew && (step == 0 || (step >= 0x80 && sync.time_us <= sync_time_us_))) return;
    if (!anew) health_.sync_gap = static_cast<std::uint16_t>(health_.sync_gap + step - 1);
    sync_counter_ = sync.ctr;
    sync_time_us_ = sync.time_us;
    counts_sync_ = true;
  }

  [[gnu::noinline]] void tick(base::Micros t) {
    const base::Micros began = board_.now();
    health_.sync = pacer_.state();
    health_.bus = board_.can.faults();
    health_.id_conflict = conflict_ticks_ > 0;
    if (conflict_ticks_ > 0) --conflict_ticks_;
    if constexpr (kWired) renew_pages();
    bus::FrameSink frame_sink(can_end());
    node_.tick(t, health_, frame_sink);
    if constexpr (node::kHasBusParameters<Estimators>) save_parameters();
    if constexpr (kCanopen) canopen_.adapter.on_tick(health_, board_.now());
    if constexpr (kWired) extras_.ticked = true;
    if constexpr (kSnapshots) send_snapshot();
    const std::int64_t took_us = (board_.now() - began).us;
    const auto us = static_cast<std::uint32_t>(took_us < 0 ? 0 : took_us > 1'000'000 ? 1'000'000 : took_us);
    if (us > health_.longest_us) health_.longest_us = us;
    if (took_us > parameters_.loop.period_us) ++health_.ticks_late;
    health_.mean_us += (static_cast<float>(us) - health_.mean_us) * 0.01F;
  }

  /// Samples of wired sensors count: the node's clock runs with the board's, and no command has switched them off.
  [[nodiscard]] bool wired_on() const requires kWired {
    return extras_.ticked && !node_.wired_off() && pacer_.state() != bus::SyncState::kLockstep;
  }
  [[nodiscard]] bool is_own(std::uint32_t offset) const {
    if constexpr (kWired) return extras_.wired.owns(offset) && wired_on();
    return false;
  }
  /// Consumed frames go onto the bus as well; once that takes no more, a log of it is no record any longer.
  /// The drivers fill a queue, so that the node's work does not stand on their stack. Frames beyond it are neither sent
  /// nor consumed: the node counts an incomplete sample.
  void poll_wired() requires kWired {
    std::size_t count = 0;
    extras_.wired.poll(board_.now(), pacer_.offset(), wired_on(), [this, &count](const base::CanFrame& frame) {
      if (count < extras_.queue.size()) extras_.queue[count++] = frame;
    });
    for (std::size_t i = 0; i < count; ++i) {
      const base::CanFrame& frame = extras_.queue[i];
      consume_wired(frame);
      if constexpr (node::kHasBusProtection<Estimators>) {
        if (parameters_.bus.guard == 0) continue;
        const auto offset = static_cast<std::uint8_t>(frame.id - parameters_.can_base);
        if (const auto guard = extras_.guards.after(offset, frame))
          consume_wired(bus::frame(parameters_.can_base, *guard));
      }
    }
  }
  void consume_wired(const base::CanFrame& frame) requires kWired {
    if (!board_.can.send(frame)) health_.unlogged = true;
    node_.on_frame(frame);
  }
  void poll_canopen() requires kCanopen {
    const auto send = [this](const base::CanFrame& frame) { return board_.can.send(frame); };
    const auto command = [this](const base::CanFrame& frame) {
      const bool sent = board_.can.send(frame);
      if (sent) node_.on_frame(frame);
      return sent;
    };
    canopen_.adapter.poll(board_.now(), pacer_.state() != bus::SyncState::kLockstep, send, command);
  }
  [[gnu::cold, gnu::noinline]] void load_parameters() requires kKeeps {
    kept_.load(node_, [this](const auto& message) { this->tell(message); });
  }
  /// Behind an epoch, of which the answer is no part. A save that wrote ends the record's stretch, as a reset does.
  void save_parameters() requires node::kHasBusParameters<Estimators> {
    if (const auto asked = node_.parameter_commands().take_save()) save_parameters(*asked);
  }
  [[gnu::cold, gnu::noinline]] void save_parameters(
      const bus::ParameterCommands::Save& asked) requires node::kHasBusParameters<Estimators> {
    bus::ParamAnswer answer = bus::ParamAnswer::kNotKept;
    bool wrote = false;
    if constexpr (kKeeps) {
      const bool may_stop = node_.parameter_commands().rests() && pacer_.state() != bus::SyncState::kLockstep;
      const auto end = kept_.save(node_.parameter_sets(), asked.before, may_stop);
      answer = end.answer, wrote = end.wrote;
    }
    if (answer != bus::ParamAnswer::kDone) ++health_.save_refused;
    tell(node_.parameter_commands().answer_to(asked, answer));
    if (!wrote) return;
    node_.power_on({});
    health_.unlogged = false;
    bus::FrameSink frame_sink(can_end());
    node_.send_version(frame_sink);
  }
  template <class Message>
  void tell(const Message& message) {
    static_cast<void>(can_end().send(bus::frame(parameters_.can_base, message)));
  }
  /// The bus for what the node sends.
  [[nodiscard]] auto& can_end() {
    if constexpr (kCanopen)
      return end_;
    else
      return board_.can;
  }
  void end_poll() {
    if constexpr (hal::WatchdogBoard<Board>) polled_ ? board_.kick() : board_.start_watchdog();
    polled_ = true;
    if constexpr (hal::IdleBoard<Board>) board_.idle();
  }
  /// The page of wired sensors holds in every epoch; the others are up to 16 ticks old.
  void renew_pages() requires kWired {
    health_.pages = &extras_.pages;
    extras_.pages[1] = bus::encode(extras_.wired.wired_page(wired_on()));
    if ((extras_.turn++ & 0xF) != 0) return;
    extras_.pages[0] = bus::encode(extras_.wired.imu_page());
    extras_.pages[2] = bus::encode(boot_page());
  }
  [[nodiscard]] bus::EstDiagBoot boot_page() {
    bus::EstDiagBoot page{.watchdog = hal::WatchdogBoard<Board> && polled_};
    if constexpr (hal::ReportingBoard<Board>) {
      const hal::BootReport& boot = board_.boot();
      page.boot_cause = static_cast<bus::BootCause>(boot.cause);
      page.fault = static_cast<bus::CpuFault>(boot.fault.fault);
      page.fallback = boot.fallback_clock;
      page.stack = board_.stack().used;
      page.fault_pc = boot.fault.program_counter;
    }
    return page;
  }
  void send_snapshot() requires kSnapshots {
    if (node_.take_snapshot_request()) {
      extras_.snapshot.freeze(node_, extras_.version, param::crc(parameters_));
      health_.unlogged = false;
    }
    extras_.snapshot.send([this](const base::CanFrame& frame) { return board_.can.send(frame); });
  }

  /// The bus, and the adapter that looks at what the node sends.
  struct End {
    explicit End(Firmware& around) : firmware(around) {}
    Firmware& firmware;
    /// Apart, for a node sends at many places.
    [[gnu::noinline]] bool send(const base::CanFrame& frame) {
      firmware.canopen_.adapter.on_sent(frame);
      return firmware.board_.can.send(frame);
    }
  };
  struct NoEnd {
    explicit NoEnd(const Firmware&) {}
  };
  struct NotKept {
    explicit NotKept(const Board&) {}
  };
  struct Canopen {
    Canopen(Board& board, const param::Parameters& p, const bus::Version& version, const Node& node)
        : adapter({.can_base = p.can_base,
                   .node_id = board.canopen_id(),
                   .keeps = kKeeps,
                   .version = version,
                   .hardware = Board::kHardware},
                  node.parameter_sets(), base::Micros{p.loop.period_us}) {}
    canopen::Adapter adapter;
  };
  struct NoCanopen {
    NoCanopen(const Board&, const param::Parameters&, const bus::Version&, const Node&) {}
  };
  struct NoSnapshot {
    NoSnapshot(std::uint32_t, base::Micros) {}
  };
  struct NoGuards {};
  struct NotWired {
    NotWired(Board&, const param::Parameters&) {}
  };
  /// Members that only some boards and robots have.
  struct Extras {
    Extras(Board& board, const param::Parameters& p, const bus::Version& v)
        : wired(board, p), snapshot(p.can_base, base::Micros{p.loop.period_us}), version(v) {}
    [[no_unique_address]] std::conditional_t<kWired, WiredInputs<Board, kParts>, NotWired> wired;
    [[no_unique_address]] std::conditional_t<kSnapshots, SnapshotSender<Node>, NoSnapshot> snapshot;
    /// Guards go out with wired samples as with others, so that a replay has them.
    [[no_unique_address]] std::conditional_t<node::kHasBusProtection<Estimators>, bus::GuardSender, NoGuards> guards;
    bus::Version version;
    std::array<bus::Payload, 3> pages{};  ///< 9 to 11 of Est_Diag
    /// Frames of one poll: at most 32 samples of an IMU, a count, ten epochs of a receiver.
    std::array<base::CanFrame, 160> queue{};
    std::uint32_t turn = 0;  ///< ticks
    bool ticked = false;     ///< the node has a time
  };
  struct NoExtras {
    NoExtras(Board&, const param::Parameters&, const bus::Version&) {}
  };

  Board& board_;
  const param::Parameters& parameters_;
  Node node_;
  Pacer pacer_;
  LockstepPolicy lockstep_;
  bus::SyncGuard sync_guard_;
  bus::LoopHealth health_;
  [[no_unique_address]] std::conditional_t<kWired || kSnapshots, Extras, NoExtras> extras_;
  [[no_unique_address]] std::conditional_t<kCanopen, Canopen, NoCanopen> canopen_;
  [[no_unique_address]] std::conditional_t<kKeeps, KeptParameters<Board>, NotKept> kept_;
  [[no_unique_address]] std::conditional_t<kCanopen, End, NoEnd> end_;
  std::int32_t conflict_ticks_ = 0;  ///< left until an id conflict is over
  std::uint64_t sync_time_us_ = 0;
  std::uint8_t sync_counter_ = 0;
  bool counts_sync_ = false;  ///< a sync frame has been there
  bool polled_ = false;       ///< sensors and watchdog run
};

}  // namespace tetap::firmware
