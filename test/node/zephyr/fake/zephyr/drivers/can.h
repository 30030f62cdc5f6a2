// SPDX-License-Identifier: Apache-2.0
// What the example needs of Zephyr's CAN (zephyr/drivers/can.h of Zephyr 3.5 and later), with the bus in the test's
// hands.
#pragma once

#include <zephyr/kernel.h>

#include <cerrno>
#include <cstddef>
#include <cstdint>

struct device {
  const char* name;
};
struct can_frame {
  std::uint32_t id : 29;
  std::uint8_t dlc;
  std::uint8_t flags;
  std::uint8_t data[8];
};
struct can_filter {
  std::uint32_t id : 29;
  std::uint32_t mask : 29;
  std::uint8_t flags;
};
using can_tx_callback_t = void (*)(const device*, int error, void*);
inline constexpr std::uint32_t CAN_STD_ID_MASK = 0x7FF;
inline constexpr std::uint8_t CAN_FRAME_IDE = 1;

template <std::size_t kRoom>
struct FakeQueue {
  can_frame frames[kRoom];
  std::size_t taken = 0, put = 0;
};
using k_msgq = FakeQueue<128>;
#define CAN_MSGQ_DEFINE(name, size) \
  k_msgq name;                      \
  static_assert((size) == 128)
#define DT_CHOSEN(node) fake_##node
#define DEVICE_DT_GET(node) &node

inline const device fake_zephyr_canbus{"can0"};
inline struct {
  std::uint32_t bit_rate = 0;
  bool started = false;
  can_filter filter{};
  k_msgq* queue = nullptr;
  bool (*take)(const can_frame&) = [](const can_frame&) { return true; };
} fake_bus;

inline int k_msgq_get(k_msgq* queue, can_frame* frame, k_timeout_t) {
  if (queue->taken == queue->put) return -ENOMSG;
  *frame = queue->frames[queue->taken++ % 128];
  return 0;
}
inline int can_set_bitrate(const device*, std::uint32_t rate) { return fake_bus.bit_rate = rate, 0; }
inline int can_add_rx_filter_msgq(const device*, k_msgq* queue, const can_filter* filter) {
  fake_bus.queue = queue;
  fake_bus.filter = *filter;
  return 0;
}
inline int can_start(const device*) { return fake_bus.started = true, 0; }
inline int can_send(const device*, const can_frame* frame, k_timeout_t, can_tx_callback_t callback, void* user) {
  if (!fake_bus.started) return -ENETDOWN;
  if (callback == nullptr || !fake_bus.take(*frame)) return -EAGAIN;  // without a callback Zephyr's call would wait
  callback(&fake_zephyr_canbus, 0, user);
  return 0;
}
/// A frame of the bus: into the queue where the filter lets it pass.
inline void fake_arrives(const can_frame& frame) {
  if (((frame.id ^ fake_bus.filter.id) & fake_bus.filter.mask) == 0 && frame.flags == fake_bus.filter.flags)
    fake_bus.queue->frames[fake_bus.queue->put++ % 128] = frame;
}
