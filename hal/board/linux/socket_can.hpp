// SPDX-License-Identifier: Apache-2.0
// A CAN controller on Linux: a raw SocketCAN socket read and written in batches (recvmmsg, sendmmsg). A slow kernel is
// asked once for many frames. The kernel counts frames lost in the socket's buffer (SO_RXQ_OVFL): they are not guessed.
#pragma once

#include "hal/can_bus.hpp"
#include "tetap/base/can_frame.hpp"
#include "tetap/base/time.hpp"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

namespace tetap::hal {

struct SocketCanOptions {
  int receive_buffer_bytes = 16 << 20;  ///< forced past net.core.rmem_max where allowed
  std::optional<Acceptance> accept{};   ///< frames that the kernel hands on; empty: all
  bool arrival_times = false;           ///< ask the kernel when each frame came
};

class SocketCan {
 public:
  /// Throws std::runtime_error with one line that names the interface and the command that helps: no such interface,
  /// down, not CAN, no SocketCAN in this kernel.
  explicit SocketCan(const std::string& interface, SocketCanOptions options = {});
  ~SocketCan();
  SocketCan(const SocketCan&) = delete;
  SocketCan& operator=(const SocketCan&) = delete;

  /// Collects; a full batch is handed on at once. Waits for room in the kernel. False: the interface is down, the frame
  /// is not taken.
  bool send(const base::CanFrame& frame);
  /// Data frames of others, in order of arrival. Remote and error frames are counted and skipped.
  std::optional<base::CanFrame> receive();
  void flush();
  [[nodiscard]] base::CanFaults faults() const { return faults_; }

  /// Hands on what was collected, then sleeps until a frame is there or the time is over. An interface that was removed
  /// is looked for here.
  void wait(base::Micros timeout);

  /// Arrival time, since 1970, of the frame last returned by receive(); only with `arrival_times`.
  [[nodiscard]] base::Micros last_arrival() const { return last_arrival_; }
  /// Remote and error frames skipped.
  [[nodiscard]] std::uint64_t ignored() const { return ignored_; }
  [[nodiscard]] const std::string& interface() const { return interface_; }

 private:
  struct Batches;  ///< buffers of the two system calls
  struct Cursor {
    std::size_t next = 0;
    std::size_t size = 0;
  };

  bool open_socket(std::string& why);
  void close_socket();
  void fill();
  void went_down();
  void recovered();

  std::string interface_;
  SocketCanOptions options_;
  int socket_ = -1;
  std::unique_ptr<Batches> batches_;
  Cursor received_;
  std::size_t to_send_ = 0;
  base::CanFaults faults_;
  std::uint32_t socket_drops_ = 0;  ///< the kernel's count for this socket
  std::uint64_t ignored_ = 0;
  base::Micros last_arrival_;
  base::Micros next_attempt_;
  bool down_ = false;
  bool lost_ = false;  ///< the interface is gone: the socket has to be bound anew
};

static_assert(CanBus<SocketCan>);

}  // namespace tetap::hal
