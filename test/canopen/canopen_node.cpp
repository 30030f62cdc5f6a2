// SPDX-License-Identifier: Apache-2.0
// A node whose bus is its standard input and output, for judges in other languages: a line ID#HEX in, the frames of the
// next 20 ms out as lines of candump -L, then a line with a dot. Time passes with the lines alone.
#include "config/mrclam.hpp"
#include "tetap/firmware/firmware.hpp"

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <deque>

namespace {

using namespace tetap;
namespace mrclam = robot::mrclam;

struct Board {
  struct Can {
    std::deque<base::CanFrame> to_node;
    const base::Micros* time = nullptr;
    bool send(const base::CanFrame& frame) const {
      const auto us = static_cast<long long>(time->us);
      std::printf("(%lld.%06lld) can0 %03X#", us / 1'000'000, us % 1'000'000, frame.id);
      for (std::size_t i = 0; i < frame.size; ++i) std::printf("%02X", frame.data[i]);
      std::puts("");
      return true;
    }
    std::optional<base::CanFrame> receive() {
      if (to_node.empty()) return std::nullopt;
      const base::CanFrame frame = to_node.front();
      return to_node.pop_front(), frame;
    }
    void flush() {}
    [[nodiscard]] base::CanFaults faults() const { return {}; }
  } can;
  base::Micros time{1'000'000};
  [[nodiscard]] base::Micros now() const { return time; }
  static constexpr const char* kHardware = "pipe";
  [[nodiscard]] static std::uint8_t canopen_id() {
    return firmware::canopen::checked_node_id(10, mrclam::parameters.can_base);
  }
};

}  // namespace

int main() {
  static Board board;
  board.can.time = &board.time;
  static firmware::Firmware<Board, node::WithBusProtection<mrclam::Estimators>> firmware{
      board, mrclam::parameters, {0x8A2D5AE, true}};
  char line[64];
  while (std::fgets(line, sizeof line, stdin) != nullptr) {
    char* data = nullptr;
    base::CanFrame frame{.id = static_cast<std::uint32_t>(std::strtoul(line, &data, 16))};
    for (++data; frame.size < 8 && data[0] > ' ' && data[1] > ' '; data += 2) {
      const char byte[3] = {data[0], data[1], 0};
      frame.data[frame.size++] = static_cast<std::uint8_t>(std::strtoul(byte, nullptr, 16));
    }
    static_cast<void>(board.can.send(frame));
    board.can.to_node.push_back(frame);
    for (int i = 0; i < 80; ++i, board.time.us += 250) firmware.poll();
    std::puts(".");
    std::fflush(stdout);
  }
}
