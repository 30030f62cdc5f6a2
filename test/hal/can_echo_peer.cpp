// SPDX-License-Identifier: Apache-2.0
// The other end of the echo test: can_echo_peer IFACE ROUNDS BURST. Each round sends BURST frames, standard and
// extended in turn, sizes 1 to 8, with pseudo-random data. Each must come back under identifier + 1 with the same bytes
// in the same order. The program prints the rounds per second; exit status 1: a frame was lost, changed or out of
// order.
#include <linux/can.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <vector>

namespace {

can_frame make(std::uint32_t number) {
  can_frame frame{};
  std::uint32_t noise = number * 2'654'435'761U + 12'345U;
  frame.can_id = (number & 1U) != 0 ? (noise % 0x1FFF'FFF0U) | CAN_EFF_FLAG : (noise >> 8) % 0x7E0U;
  frame.len = static_cast<std::uint8_t>(1 + number % 8);
  for (int i = 0; i < frame.len; ++i) {
    noise = noise * 1'664'525U + 1'013'904'223U;
    frame.data[i] = static_cast<std::uint8_t>(noise >> 24);
  }
  return frame;
}

bool receive(int socket, can_frame& frame, int timeout_ms) {
  pollfd ready{.fd = socket, .events = POLLIN, .revents = 0};
  return poll(&ready, 1, timeout_ms) > 0 && read(socket, &frame, sizeof frame) == sizeof frame;
}

bool send(int socket, const can_frame& frame) { return write(socket, &frame, sizeof frame) == sizeof frame; }

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) return std::fprintf(stderr, "usage: can_echo_peer IFACE ROUNDS BURST\n"), 2;
  const auto rounds = static_cast<std::uint32_t>(std::strtoul(argv[2], nullptr, 10));
  const auto burst = static_cast<std::uint32_t>(std::strtoul(argv[3], nullptr, 10));
  const int socket = ::socket(PF_CAN, SOCK_RAW, CAN_RAW);
  sockaddr_can address{};
  address.can_family = AF_CAN;
  address.can_ifindex = static_cast<int>(if_nametoindex(argv[1]));
  if (socket < 0 || address.can_ifindex == 0 ||
      bind(socket, reinterpret_cast<sockaddr*>(&address), sizeof address) != 0) {
    return std::fprintf(stderr, "can_echo_peer: %s: %s\n", argv[1], std::strerror(errno)), 2;
  }

  // The image answers from the moment its controller is on; until then frames go nowhere.
  can_frame got{};
  const can_frame hello = make(0);
  int attempts = 0;
  while (!send(socket, hello) || !receive(socket, got, 100) || got.can_id != hello.can_id + 1) {
    if (++attempts == 100) return std::fprintf(stderr, "can_echo_peer: no answer in 10 s\n"), 1;
  }
  while (receive(socket, got, 300)) {
  }

  const auto start = std::chrono::steady_clock::now();
  std::uint32_t number = 0;
  for (std::uint32_t round = 0; round < rounds; ++round) {
    for (std::uint32_t i = 0; i < burst; ++i) {
      if (!send(socket, make(number + i)))
        return std::fprintf(stderr, "can_echo_peer: send: %s\n", std::strerror(errno)), 1;
    }
    for (std::uint32_t i = 0; i < burst; ++i, ++number) {
      can_frame want = make(number);
      ++want.can_id;
      if (!receive(socket, got, 2000))
        return std::fprintf(stderr, "can_echo_peer: frame %u of %u: no echo\n", number, rounds * burst), 1;
      if (got.can_id != want.can_id || got.len != want.len || std::memcmp(got.data, want.data, want.len) != 0) {
        return std::fprintf(stderr, "can_echo_peer: frame %u: sent %08X, came back as %08X or with other data\n",
                            number, want.can_id - 1, got.can_id),
               1;
      }
    }
  }
  const double elapsed_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  std::printf("can_echo_peer: %u frames echoed, none lost; %.0f rounds/s with %u frames each way\n", number,
              rounds / elapsed_s, burst);
  close(socket);
  return 0;
}
