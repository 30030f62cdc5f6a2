// SPDX-License-Identifier: Apache-2.0
// tetap on a chip of your own, as an application of Zephyr: a rover's odometry and pose filter on the bus at 500
// kbit/s.
#include <zephyr/drivers/can.h>
#include <zephyr/kernel.h>

#include "tetap/estimators/odometry.hpp"
#include "tetap/estimators/planar/pose_ekf.hpp"
#include "tetap/firmware/chip_board.hpp"
#include "tetap/firmware/firmware.hpp"

#include <algorithm>

using namespace tetap;

const device* const can_bus = DEVICE_DT_GET(DT_CHOSEN(zephyr_canbus));
CAN_MSGQ_DEFINE(received, 128);

struct MyChip {
  bool send(const base::CanFrame& frame) {
    can_frame out{};
    out.id = frame.id & CAN_STD_ID_MASK;
    out.dlc = frame.size;
    std::copy_n(frame.data.begin(), frame.size, out.data);
    // With a callback the call does not wait for the bus.
    return can_send(
               can_bus, &out, K_NO_WAIT, [](const device*, int, void*) {}, nullptr) == 0;
  }
  std::optional<base::CanFrame> receive() {
    can_frame in;
    if (k_msgq_get(&received, &in, K_NO_WAIT) != 0) return std::nullopt;
    base::CanFrame frame{
        .id = in.id, .extended = (in.flags & CAN_FRAME_IDE) != 0, .size = std::min<std::uint8_t>(in.dlc, 8)};
    std::copy_n(in.data, frame.size, frame.data.begin());
    return frame;
  }
  std::uint32_t now_us() {
    return static_cast<std::uint32_t>(k_ticks_to_us_floor64(static_cast<std::uint64_t>(k_uptime_ticks())));
  }
  void wait() { k_usleep(500); }
} my_chip;

constexpr param::Parameters kMyRobot = param::checked({
    .wheels = {.drive = {.left_radius_m = 0.1F,
                         .right_radius_m = 0.1F,
                         .track_m = 0.5F,
                         .counts_per_turn = 2000,
                         .noise_left = 1e-3F,
                         .noise_right = 1e-3F}},
});
using MyEstimators = node::Estimators<estimators::Odometry, estimators::PoseEkf>;

int main() {
  can_filter inputs{};
  inputs.id = kMyRobot.can_base;
  inputs.mask = CAN_STD_ID_MASK & ~0x1FU;
  if (can_set_bitrate(can_bus, 500'000) != 0 || can_add_rx_filter_msgq(can_bus, &received, &inputs) < 0 ||
      can_start(can_bus) != 0)
    return 1;
  static firmware::ChipBoard my_board(my_chip);
  static firmware::Firmware<firmware::ChipBoard<MyChip>, MyEstimators> my_robot(my_board, kMyRobot, bus::Version{});
  while (true) {
    my_robot.poll();
    my_board.idle();
  }
}
