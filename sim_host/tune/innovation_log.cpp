// SPDX-License-Identifier: Apache-2.0
#include "sim_host/tune/innovation_log.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <stdexcept>
#include <string_view>

namespace tetap::sim {

namespace {

InnovationLog* listening = nullptr;

constexpr std::size_t kMost = 16;  ///< components of a measurement

}  // namespace

InnovationLog::InnovationLog() { listening = this; }
InnovationLog::~InnovationLog() { listening = nullptr; }

std::uint8_t InnovationLog::place_of(std::string_view model) {
  const auto found = std::find(models_.begin(), models_.end(), model);
  const auto place = static_cast<std::uint8_t>(found - models_.begin());
  if (found == models_.end()) models_.emplace_back(model);
  return place;
}

void InnovationLog::add(const filter::UpdateView& update) {
  const std::size_t m = update.nu.size();
  if (m == 0 || m > kMost)
    throw std::logic_error(std::string(update.model) + ": " + std::to_string(m) + " components, not 1 to 16");
  const std::uint8_t model = place_of(update.model);
  std::array<std::array<double, kMost>, kMost> l{};
  std::array<double, kMost> d{}, e{};
  for (std::size_t r = 0; r < m; ++r) {
    e[r] = static_cast<double>(update.nu[r]);
    d[r] = static_cast<double>(update.s[r * m + r]);
    for (std::size_t c = 0; c < r; ++c) {
      double sum = static_cast<double>(update.s[r * m + c]);
      for (std::size_t k = 0; k < c; ++k) sum -= l[r][k] * l[c][k] * d[k];
      l[r][c] = sum / d[c];
      d[r] -= l[r][c] * l[r][c] * d[c];
      e[r] -= l[r][c] * e[c];
    }
  }
  for (std::size_t i = 0; i < m; ++i)
    terms_.push_back({.time_ms = time_ms_,
                      .nis = update.nis,
                      .gate = update.gate,
                      .log_variance = static_cast<float>(std::log(d[i])),
                      .innovation = static_cast<float>(e[i]),
                      .model = model,
                      .verdict = static_cast<std::uint8_t>(update.verdict),
                      .component = static_cast<std::uint8_t>(i),
                      .components = static_cast<std::uint8_t>(m)});
}

}  // namespace tetap::sim

void tetap::filter::view(const UpdateView& update) {
  if (tetap::sim::listening != nullptr) tetap::sim::listening->add(update);
}
