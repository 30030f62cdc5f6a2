// SPDX-License-Identifier: Apache-2.0
#include "hal/board/linux/socket_can.hpp"

#include "hal/board/linux/clock.hpp"

#include <linux/can.h>
#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <net/if_arp.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <stdexcept>

namespace tetap::hal {

namespace {

constexpr std::size_t kBatch = 256;
constexpr base::Micros kRetryOpen{100'000};
constexpr base::Micros kPatience{1'000'000};  ///< for room in a transmit queue that does not move

/// Room for the drop counter and the time stamp.
union Control {
  cmsghdr align;
  std::array<char, CMSG_SPACE(sizeof(std::uint32_t)) + CMSG_SPACE(sizeof(timeval))> bytes;
};

std::string setup_hint(const std::string& interface) {
  if (interface.rfind("vcan", 0) == 0)
    return "ip link add dev " + interface + " type vcan && ip link set up " + interface;
  return "ip link set " + interface + " up type can bitrate 500000";
}

can_frame to_kernel(const base::CanFrame& frame) {
  can_frame raw{};
  raw.can_id = frame.extended ? (frame.id & CAN_EFF_MASK) | CAN_EFF_FLAG : frame.id & CAN_SFF_MASK;
  raw.can_dlc = std::min<std::uint8_t>(frame.size, CAN_MAX_DLEN);
  std::memcpy(raw.data, frame.data.data(), raw.can_dlc);
  return raw;
}

base::CanFrame from_kernel(const can_frame& raw) {
  base::CanFrame frame;
  frame.extended = (raw.can_id & CAN_EFF_FLAG) != 0;
  frame.id = raw.can_id & (frame.extended ? CAN_EFF_MASK : CAN_SFF_MASK);
  frame.size = std::min<std::uint8_t>(raw.can_dlc, CAN_MAX_DLEN);
  std::memcpy(frame.data.data(), raw.data, frame.size);
  return frame;
}

}  // namespace

struct SocketCan::Batches {
  std::array<can_frame, kBatch> in_frames{}, out_frames{};
  std::array<iovec, kBatch> in_parts{}, out_parts{};
  std::array<mmsghdr, kBatch> in{}, out{};
  std::array<Control, kBatch> control{};

  Batches() {
    for (std::size_t i = 0; i < kBatch; ++i) {
      in_parts[i] = {.iov_base = &in_frames[i], .iov_len = sizeof(can_frame)};
      out_parts[i] = {.iov_base = &out_frames[i], .iov_len = sizeof(can_frame)};
      in[i].msg_hdr.msg_iov = &in_parts[i];
      out[i].msg_hdr.msg_iov = &out_parts[i];
      in[i].msg_hdr.msg_iovlen = out[i].msg_hdr.msg_iovlen = 1;
      in[i].msg_hdr.msg_control = control[i].bytes.data();
    }
  }
};

SocketCan::SocketCan(const std::string& interface, SocketCanOptions options)
    : interface_(interface), options_(options), batches_(std::make_unique<Batches>()) {
  std::string why;
  if (!open_socket(why)) throw std::runtime_error(why);
}

SocketCan::~SocketCan() {
  flush();
  close_socket();
}

void SocketCan::close_socket() {
  if (socket_ >= 0) close(socket_);
  socket_ = -1;
}

bool SocketCan::open_socket(std::string& why) {
  close_socket();
  const auto refuse = [&](const std::string& reason) {
    why = reason;
    close_socket();
    return false;
  };
  socket_ = socket(AF_CAN, SOCK_RAW | SOCK_CLOEXEC, CAN_RAW);
  if (socket_ < 0) {
    return refuse("CAN interface " + interface_ + ": this kernel has no SocketCAN (" + std::strerror(errno) +
                  "); run the command under tools/run/provide_vcan");
  }
  ifreq request{};
  if (interface_.empty() || interface_.size() >= sizeof request.ifr_name)
    return refuse("'" + interface_ + "' is not a name for an interface: 1 to 15 characters");
  interface_.copy(request.ifr_name, sizeof request.ifr_name - 1);
  if (ioctl(socket_, SIOCGIFINDEX, &request) < 0)
    return refuse("CAN interface " + interface_ + " does not exist; make it with: " + setup_hint(interface_));
  const int index = request.ifr_ifindex;
  if (ioctl(socket_, SIOCGIFHWADDR, &request) == 0 && request.ifr_hwaddr.sa_family != ARPHRD_CAN)
    return refuse("interface " + interface_ + " is not a CAN interface; make one with: " + setup_hint("vcan0"));
  if (ioctl(socket_, SIOCGIFFLAGS, &request) < 0 || (request.ifr_flags & IFF_UP) == 0)
    return refuse("CAN interface " + interface_ + " is down; start it with: ip link set up " + interface_);

  const int yes = 1;
  const int size = options_.receive_buffer_bytes;
  if (setsockopt(socket_, SOL_SOCKET, SO_RCVBUFFORCE, &size, sizeof size) < 0)  // needs CAP_NET_ADMIN
    setsockopt(socket_, SOL_SOCKET, SO_RCVBUF, &size, sizeof size);
  setsockopt(socket_, SOL_SOCKET, SO_RXQ_OVFL, &yes, sizeof yes);
  if (options_.arrival_times) setsockopt(socket_, SOL_SOCKET, SO_TIMESTAMP, &yes, sizeof yes);
  if (options_.accept) {
    const can_filter wanted{.can_id = options_.accept->id,
                            .can_mask = options_.accept->mask | CAN_EFF_FLAG | CAN_RTR_FLAG};
    setsockopt(socket_, SOL_CAN_RAW, CAN_RAW_FILTER, &wanted, sizeof wanted);
  }
  const can_err_mask_t errors = CAN_ERR_BUSOFF | CAN_ERR_CRTL | CAN_ERR_RESTARTED;
  setsockopt(socket_, SOL_CAN_RAW, CAN_RAW_ERR_FILTER, &errors, sizeof errors);
  socket_drops_ = 0;

  sockaddr_can address{};
  address.can_family = AF_CAN;
  address.can_ifindex = index;
  if (bind(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address) < 0)
    return refuse("CAN interface " + interface_ + ": " + std::strerror(errno));
  return true;
}

bool SocketCan::send(const base::CanFrame& frame) {
  if (to_send_ == kBatch) flush();
  if (lost_) {
    ++faults_.tx_full;
    return false;
  }
  batches_->out_frames[to_send_++] = to_kernel(frame);
  faults_.tx_high = std::max(faults_.tx_high, static_cast<std::uint32_t>(to_send_));
  return true;
}

void SocketCan::flush() {
  std::size_t done = 0;
  const base::Micros began = to_send_ > 0 ? monotonic_clock() : base::Micros{};
  while (done < to_send_ && !lost_) {
    const int sent = sendmmsg(socket_, &batches_->out[done], static_cast<unsigned>(to_send_ - done), MSG_DONTWAIT);
    if (sent > 0) {
      done += static_cast<std::size_t>(sent);
      recovered();
      continue;
    }
    const int reason = errno;
    if (reason == EINTR) continue;
    const bool full = reason == ENOBUFS || reason == EAGAIN || reason == EWOULDBLOCK;
    if (full && monotonic_clock() - began < kPatience) {
      // A full transmit queue (ENOBUFS) does not show in poll(): a short sleep is what the kernel's documentation asks
      // for.
      if (reason == ENOBUFS) {
        sleep_for({200});
      } else {
        pollfd ready{.fd = socket_, .events = POLLOUT, .revents = 0};
        poll(&ready, 1, 10);
      }
      continue;
    }
    if (!full) went_down();
    if (reason == ENXIO || reason == ENODEV) lost_ = true;
    break;
  }
  faults_.tx_full += static_cast<std::uint32_t>(to_send_ - done);
  to_send_ = 0;
}

void SocketCan::went_down() {
  if (!down_) ++faults_.bus_off;
  down_ = true;
}

void SocketCan::recovered() { down_ = false; }

void SocketCan::fill() {
  if (lost_) return;
  for (std::size_t i = 0; i < kBatch; ++i) batches_->in[i].msg_hdr.msg_controllen = sizeof(Control::bytes);
  const int count = recvmmsg(socket_, batches_->in.data(), kBatch, MSG_DONTWAIT, nullptr);
  received_ = {};
  if (count > 0) {
    received_.size = static_cast<std::size_t>(count);
    recovered();
    return;
  }
  if (count < 0 && errno == ENETDOWN) went_down();
  if (count < 0 && (errno == ENODEV || errno == ENXIO)) {
    went_down();
    lost_ = true;
  }
}

std::optional<base::CanFrame> SocketCan::receive() {
  for (;;) {
    if (received_.next == received_.size) fill();
    if (received_.next == received_.size) return std::nullopt;
    const std::size_t i = received_.next++;
    msghdr& header = batches_->in[i].msg_hdr;
    for (cmsghdr* part = CMSG_FIRSTHDR(&header); part != nullptr; part = CMSG_NXTHDR(&header, part)) {
      if (part->cmsg_level != SOL_SOCKET) continue;
      if (part->cmsg_type == SO_RXQ_OVFL) {
        std::uint32_t drops = 0;
        std::memcpy(&drops, CMSG_DATA(part), sizeof drops);
        faults_.rx_overflow += drops - socket_drops_;
        socket_drops_ = drops;
      } else if (part->cmsg_type == SO_TIMESTAMP) {
        timeval time{};
        std::memcpy(&time, CMSG_DATA(part), sizeof time);
        last_arrival_ = {std::int64_t{time.tv_sec} * 1'000'000 + time.tv_usec};
      }
    }
    const can_frame& raw = batches_->in_frames[i];
    if (batches_->in[i].msg_len != sizeof raw || (raw.can_id & (CAN_ERR_FLAG | CAN_RTR_FLAG)) != 0) {
      ++ignored_;
      if ((raw.can_id & CAN_ERR_FLAG) != 0) {
        if ((raw.can_id & CAN_ERR_BUSOFF) != 0) ++faults_.bus_off;
        if ((raw.can_id & CAN_ERR_CRTL) != 0 && (raw.data[1] & CAN_ERR_CRTL_RX_OVERFLOW) != 0) ++faults_.rx_overflow;
      }
      continue;
    }
    return from_kernel(raw);
  }
}

void SocketCan::wait(base::Micros timeout) {
  flush();
  if (received_.next != received_.size) return;
  if (lost_) {
    const base::Micros now = monotonic_clock();
    std::string why;
    if (now >= next_attempt_) {
      next_attempt_ = now + kRetryOpen;
      lost_ = !open_socket(why);
    }
    if (lost_) return sleep_for(std::min(timeout, kRetryOpen));
    recovered();
  }
  const timespec limit{.tv_sec = static_cast<time_t>(timeout.us / 1'000'000),
                       .tv_nsec = static_cast<long>(timeout.us % 1'000'000) * 1000};
  pollfd ready{.fd = socket_, .events = POLLIN, .revents = 0};
  if (timeout.us > 0) ppoll(&ready, 1, &limit, nullptr);
}

}  // namespace tetap::hal
