// SPDX-License-Identifier: Apache-2.0
// Demands of the firmware on a board. A port is a struct that satisfies Board; the compiler names what is missing. The
// concepts below find what else a board has: one without a watchdog or without a sensor is a board.
#pragma once

#include "hal/board_report.hpp"
#include "hal/byte_stream.hpp"
#include "hal/can_bus.hpp"
#include "hal/encoder_counter.hpp"
#include "hal/spi_device.hpp"
#include "hal/storage.hpp"
#include "tetap/base/time.hpp"

#include <concepts>
#include <cstdint>
#include <type_traits>

namespace tetap::hal {

template <class B>
concept Board = requires(B& board) {
  /// Microseconds since start: monotonic, at least 100 us resolution; 1 us where sensors are wired. Only the loop reads
  /// it, to decide when to tick and to stamp wired samples.
  { board.now() } -> std::same_as<base::Micros>;
  requires CanBus<decltype(B::can)>;
};

/// A board that can sleep between two polls.
template <class B>
concept IdleBoard = Board<B> && requires(B& board) {
  /// Returns at the next interrupt, at the latest after 1 ms. An interrupt between the last look at the board and this
  /// call must end it, too.
  { board.idle() } -> std::same_as<void>;
};

/// A board whose sensors need a start: ring buffers, edge captures, clocks of their own.
template <class B>
concept SensorBoard = Board<B> && requires(B& board) {
  /// Called once, after the self-check and before the sensors are polled: a line that receives during the self-check
  /// only loses bytes.
  { board.start_sensors() } -> std::same_as<void>;
};

template <class B>
concept WatchdogBoard = Board<B> && requires(B& board) {
  /// Called once, after the self-check and the first poll of the sensors: both take longer than a poll. From then on
  /// the board resets itself unless kick() comes in time.
  { board.start_watchdog() } -> std::same_as<void>;
  /// Called at the end of each poll, never by an interrupt.
  { board.kick() } -> std::same_as<void>;
};

/// A board that knows why it started, and how deep its stack has been.
template <class B>
concept ReportingBoard = Board<B> && requires(B& board) {
  { board.boot() } -> std::convertible_to<const BootReport&>;
  { board.stack() } -> std::same_as<StackUse>;
};

/// A board with memory for a second copy of the node's state, which a recording that begins after boot starts from.
template <class B>
concept SnapshotBoard = Board<B> && std::remove_cvref_t<B>::kSnapshots;

/// A board that keeps what the node saves.
template <class B>
concept StorageBoard = Board<B> && requires(B& board) {
  requires Storage<typename B::Storage>;
  { B::storage() } -> std::same_as<typename B::Storage>;
  /// The watchdog waits for two of the longest erases, from now on and anew from each call.
  { board.begin_storing() } -> std::same_as<void>;
  /// The watchdog waits as before; where it did not run, it runs.
  { board.end_storing() } -> std::same_as<void>;
};

/// A board on a CANopen bus.
template <class B>
concept CanopenBoard = Board<B> && requires(const B& board) {
  /// 1 to 127, from switches or a constant, read once; 0: none, and the node is no CANopen node.
  { board.canopen_id() } -> std::same_as<std::uint8_t>;
  /// Its name and revision, 16 characters at most.
  { B::kHardware } -> std::convertible_to<const char*>;
};

// Wired sensors: members of the board, each on the clock of now().

/// An inertial sensor on an SPI bus: the chip select and the bus are its own.
template <class B>
concept ImuBoard = Board<B> && requires(B& board) {
  requires SpiDevice<std::remove_cvref_t<decltype(board.imu)>>;
};

/// Two quadrature encoders. Their counters run from the board's start on.
template <class B>
concept EncoderBoard = Board<B> && requires(B& board) {
  requires EncoderCounter<std::remove_cvref_t<decltype(board.left_encoder)>>;
  requires EncoderCounter<std::remove_cvref_t<decltype(board.right_encoder)>>;
};

/// A GNSS receiver on a serial line. It keeps what arrives during a poll of 20 ms; more is counted as lapped.
template <class B>
concept GnssBoard = Board<B> && requires(B& board) {
  requires ByteStream<std::remove_cvref_t<decltype(board.gnss)>>;
};

}  // namespace tetap::hal
