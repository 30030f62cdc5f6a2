// SPDX-License-Identifier: Apache-2.0
#include "sim_host/matrix/dbc.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <istream>
#include <stdexcept>

namespace tetap::sim {

namespace {

constexpr std::uint32_t kFileBase = 0x300;

[[noreturn]] void refuse(std::size_t number, const std::string& line) {
  throw std::runtime_error("DBC line " + std::to_string(number) + " cannot be read: " + line);
}

/// `SG_ name [m0|M] : start|length@1+ (factor,offset) [least|most]`.
DbcSignal signal_of(const std::string& line, std::size_t number) {
  const std::size_t colon = line.find(':');
  char name[64] = "", sign = '?';
  unsigned order = 0;
  DbcSignal s;
  const bool named = std::sscanf(line.c_str(), " SG_ %63s", name) == 1 && colon != std::string::npos;
  if (!named || std::sscanf(line.c_str() + colon + 1, " %u|%u@%u%c (%lf,%lf) [%lf|%lf]", &s.start, &s.length, &order,
                            &sign, &s.factor, &s.offset, &s.least, &s.most) != 8)
    refuse(number, line);
  if (order != 1 || (sign != '+' && sign != '-') || s.length == 0 || s.start + s.length > 64) refuse(number, line);
  s.name = name;
  s.is_signed = sign == '-';
  return s;
}

}  // namespace

std::int64_t DbcSignal::raw(const base::CanFrame& frame) const {
  std::uint64_t bits = 0;
  for (std::size_t i = 0; i < 8; ++i) bits |= std::uint64_t{frame.data[i]} << (8 * i);
  const std::uint64_t mask = ~std::uint64_t{0} >> (64 - length);
  const std::uint64_t field = bits >> start & mask;
  if (is_signed && (field >> (length - 1) & 1) != 0) return static_cast<std::int64_t>(field | ~mask);
  return static_cast<std::int64_t>(field);
}

void DbcSignal::set_raw(base::CanFrame& frame, std::int64_t value) const {
  for (unsigned bit = 0; bit < length; ++bit) {
    const unsigned at = start + bit;
    const auto mask = static_cast<std::uint8_t>(1U << (at % 8));
    const bool on = (static_cast<std::uint64_t>(value) >> bit & 1) != 0;
    auto& byte = frame.data[at / 8];
    byte = static_cast<std::uint8_t>(on ? byte | mask : byte & ~mask);
  }
}

double DbcSignal::value(const base::CanFrame& frame) const { return static_cast<double>(raw(frame)) * factor + offset; }

std::int64_t DbcSignal::nearest(double value) const {
  const double kept = std::clamp(value, std::min(least, most), std::max(least, most));
  return std::llround((kept - offset) / factor);
}

std::int64_t DbcSignal::not_available() const {
  return is_signed ? -(std::int64_t{1} << (length - 1)) : static_cast<std::int64_t>(~std::uint64_t{0} >> (64 - length));
}

bool DbcSignal::has_not_available() const {
  const double code = static_cast<double>(not_available()) * factor + offset;
  return code < least - factor / 2 || code > most + factor / 2;
}

const DbcSignal* DbcMessage::find(std::string_view signal) const {
  const auto found = std::find_if(signals.begin(), signals.end(), [&](const auto& s) { return s.name == signal; });
  return found == signals.end() ? nullptr : &*found;
}

BusDatabase::BusDatabase(std::istream& dbc) { read(dbc); }

BusDatabase::BusDatabase(const std::string& path) {
  std::ifstream file(path);
  if (!file) throw std::runtime_error(path + ": cannot be opened");
  read(file);
}

void BusDatabase::read(std::istream& dbc) {
  std::string line;
  for (std::size_t number = 1; std::getline(dbc, line); ++number) {
    if (line.starts_with("BO_ ")) {
      unsigned id = 0;
      char name[64] = "";
      if (std::sscanf(line.c_str(), "BO_ %u %63[^:]:", &id, name) != 2) refuse(number, line);
      messages_.push_back({.name = name, .offset = id - kFileBase, .signals = {}});
    } else if (line.starts_with(" SG_ ")) {
      if (messages_.empty()) refuse(number, line);
      messages_.back().signals.push_back(signal_of(line, number));
    }
  }
  if (messages_.empty()) throw std::runtime_error("DBC: no message");
}

const DbcMessage* BusDatabase::at(std::uint32_t offset) const {
  const auto found =
      std::find_if(messages_.begin(), messages_.end(), [&](const auto& m) { return m.offset == offset; });
  return found == messages_.end() ? nullptr : &*found;
}

const DbcMessage& BusDatabase::message(std::string_view name) const {
  const auto found = std::find_if(messages_.begin(), messages_.end(), [&](const auto& m) { return m.name == name; });
  if (found == messages_.end()) throw std::runtime_error("DBC: no message " + std::string(name));
  return *found;
}

const DbcSignal& BusDatabase::signal(std::string_view of, std::string_view name) const {
  if (const DbcSignal* found = message(of).find(name)) return *found;
  throw std::runtime_error("DBC: no signal " + std::string(name) + " in " + std::string(of));
}

}  // namespace tetap::sim
