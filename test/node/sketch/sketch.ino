// SPDX-License-Identifier: Apache-2.0
// tetap on a chip of your own, as an Arduino sketch: a rover's odometry and pose filter on the bus at 500 kbit/s.
#include <Arduino_CAN.h>

#include "tetap/estimators/odometry.hpp"
#include "tetap/estimators/planar/pose_ekf.hpp"
#include "tetap/firmware/chip_board.hpp"
#include "tetap/firmware/firmware.hpp"

using namespace tetap;

struct MyChip {
  bool send(const base::CanFrame& frame) {
    return CAN.write(CanMsg(CanStandardId(frame.id), frame.size, frame.data.data())) > 0;
  }
  std::optional<base::CanFrame> receive() {
    if (CAN.available() == 0) return std::nullopt;
    const CanMsg message = CAN.read();
    base::CanFrame frame{.id = message.isStandardId() ? message.getStandardId() : message.getExtendedId(),
                         .extended = !message.isStandardId(),
                         .size = message.data_length};
    for (std::size_t i = 0; i < frame.size; ++i) frame.data[i] = message.data[i];
    return frame;
  }
  std::uint32_t now_us() { return micros(); }
  void wait() {}
} my_chip;

constexpr param::Parameters kMyRobot = param::checked({
    .wheels = {.drive = {.left_radius_m = 0.1F, .right_radius_m = 0.1F, .track_m = 0.5F, .counts_per_turn = 2000,
                         .noise_left = 1e-3F, .noise_right = 1e-3F}},
});
using MyEstimators = node::Estimators<estimators::Odometry, estimators::PoseEkf>;

firmware::ChipBoard my_board(my_chip);
firmware::Firmware<firmware::ChipBoard<MyChip>, MyEstimators> my_robot(my_board, kMyRobot, bus::Version{});

void setup() { CAN.begin(CanBitRate::BR_500k); }
void loop() { my_robot.poll(); }
