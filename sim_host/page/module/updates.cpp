// SPDX-License-Identifier: Apache-2.0
#include "sim_host/page/module/updates.hpp"

#include "sim_host/page/module/json.hpp"

#include <cmath>
#include <cstddef>
#include <span>
#include <utility>

namespace tetap::page {

namespace {

UpdateLog* listening = nullptr;

/// JSON has no number that is not finite.
void put(Json& json, const char* name, std::span<const float> values) {
  json.key(name).begin('[');
  for (const float value : values) json.value(std::isfinite(value) ? static_cast<double>(value) : 0.0);
  json.end(']');
}

constexpr const char* name_of(filter::Verdict verdict) {
  switch (verdict) {
    case filter::Verdict::kAccepted:
      return "Accepted";
    case filter::Verdict::kRejected:
      return "Rejected";
    case filter::Verdict::kSingular:
      return "Singular";
    case filter::Verdict::kNotFinite:
      break;
  }
  return "NotFinite";
}

}  // namespace

UpdateLog::UpdateLog() { listening = this; }
UpdateLog::~UpdateLog() { listening = nullptr; }

void UpdateLog::next(base::Micros time, base::Micros keep) {
  after_ = time;
  std::size_t old = 0;
  while (old < entries_.size() && entries_[old].after < keep) ++old;
  entries_.erase(entries_.begin(), entries_.begin() + static_cast<std::ptrdiff_t>(old));
}

void UpdateLog::add(const filter::UpdateView& update) {
  if (!takes) return;
  Json json;
  json.begin('{')
      .member("after_s", static_cast<double>(after_.us) * 1e-6)
      .member("model", update.model)
      .member("states", update.at.size())
      .member("components", update.nu.size())
      .member("verdict", name_of(update.verdict))
      .member("nis", std::isfinite(update.nis) ? static_cast<double>(update.nis) : 1e30)
      .member("gate", std::isfinite(update.gate) ? static_cast<double>(update.gate) : 1e30);
  put(json, "at", update.at);
  put(json, "moved", update.moved);
  put(json, "prior", update.prior);
  put(json, "posterior", update.posterior);
  put(json, "h", update.h);
  put(json, "noise", update.noise);
  put(json, "nu", update.nu);
  put(json, "s", update.s);
  entries_.push_back({after_, json.end('}').text()});
}

std::string UpdateLog::json() const {
  std::string text = "[";
  for (const Entry& entry : entries_) text += (text.size() > 1 ? "," : "") + entry.json;
  return text + ']';
}

}  // namespace tetap::page

void tetap::filter::view(const UpdateView& update) {
  if (page::listening != nullptr) page::listening->add(update);
}
