// SPDX-License-Identifier: Apache-2.0
#include "sim_host/parameter_settings.hpp"

#include "sim_host/parameter_refusal.hpp"

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <fstream>
#include <sstream>

namespace tetap::sim {
namespace {

std::string_view trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(" \t\r");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
}

template <class Number>
std::string shortest(Number value) {
  char text[64];
  return {text, std::to_chars(text, text + sizeof text, value).ptr};
}

std::string element_text(const param::Row& row, double value) {
  if (row.storage == param::Storage::kFloat) return shortest(static_cast<float>(value));
  return row.storage == param::Storage::kWhole ? shortest(static_cast<long long>(value)) : shortest(value);
}

double number(std::string_view text, const param::Row& row, const std::string& where) {
  const std::string_view digits = text.starts_with("+") ? text.substr(1) : text;
  double value = 0;
  if (digits.starts_with("0x")) {
    std::uint64_t whole = 0;
    const auto [end, error] = std::from_chars(digits.data() + 2, digits.data() + digits.size(), whole, 16);
    if (error == std::errc{} && end == digits.data() + digits.size()) return static_cast<double>(whole);
  }
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (error != std::errc{} || end != digits.data() + digits.size())
    throw UsageError(where + ": " + row.path + ": '" + std::string(text) + "' is no number");
  return value;
}

double checked_number(std::string_view text, const param::Row& row, const std::string& where) {
  const double value = number(text, row, where);
  if (const std::string why = refusal_of(row, value); !why.empty()) throw UsageError(where + ": " + why);
  return value;
}

std::vector<double> checked_numbers(std::string_view text, const param::Row& row, const std::string& where) {
  std::vector<double> values;
  for (std::size_t at = 0; (at = text.find_first_not_of(" \t,", at)) != std::string_view::npos;) {
    const std::size_t end = std::min(text.find_first_of(" \t,", at), text.size());
    values.push_back(checked_number(text.substr(at, end - at), row, where));
    at = end;
  }
  if (values.size() != row.elements)
    throw UsageError(where + ": " + row.path + " has " + std::to_string(row.elements) + " value" +
                     (row.elements == 1 ? "" : "s") + ", not " + std::to_string(values.size()));
  return values;
}

}  // namespace

ParameterSettings::ParameterSettings(Arguments& arguments) {
  for (const std::string& name : arguments.texts("--params")) {
    std::ifstream file(name);
    std::ostringstream text;
    if (!file || !(text << file.rdbuf())) throw UsageError("--params " + name + ": " + std::strerror(errno));
    read(text.str(), name);
  }
  for (const std::string& setting : arguments.texts("--set")) set(setting, "--set " + setting);
}

void ParameterSettings::read(std::string_view text, const std::string& name) {
  for (std::size_t line = 1; !text.empty(); ++line) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    const std::string_view setting = trimmed(text.substr(0, std::min(text.find('#'), end)));
    if (!setting.empty()) set(setting, name + ":" + std::to_string(line));
    text.remove_prefix(std::min(end + 1, text.size()));
  }
}

void ParameterSettings::set(std::string_view setting, const std::string& where) {
  const std::size_t sign = setting.find('=');
  if (sign == std::string_view::npos) throw UsageError(where + ": '" + std::string(setting) + "' is not PATH = VALUE");
  const std::string_view path = trimmed(setting.substr(0, sign));
  const param::Row* const row = param::row_of(path);
  if (row == nullptr) throw UsageError(where + ": no parameter '" + std::string(path) + "' (tetap-params lists them)");
  settings_.push_back({.where = where, .row = row, .values = checked_numbers(setting.substr(sign + 1), *row, where)});
}

/// The last setting of a field that the rule names.
std::string ParameterSettings::place_of(const param::Rule& rule) const {
  for (auto one = settings_.rbegin(); one != settings_.rend(); ++one)
    if (std::string_view(rule.path) == one->row->path || std::strstr(rule.text, one->row->path) != nullptr)
      return one->where;
  return settings_.empty() ? "the robot" : settings_.back().where;
}

param::Parameters ParameterSettings::unchecked_over(param::Parameters parameters) const {
  for (const Setting& one : settings_)
    for (std::size_t i = 0; i < one.values.size(); ++i) one.row->set(parameters, i, one.values[i]);
  return parameters;
}

param::Parameters ParameterSettings::over(param::Parameters parameters) const {
  parameters = unchecked_over(parameters);
  const param::Rule* const broken = param::broken_rule(parameters);
  if (broken == nullptr) return parameters;
  const param::Row* const row = param::row_of(broken->path);
  const std::string subject = row == nullptr || row->elements > 1 ? std::string(broken->path) + " has to be "
                                                                  : refused(*row, row->get(parameters, 0));
  throw UsageError(place_of(*broken) + ": " + subject + broken->text);
}

std::string ParameterSettings::words() const {
  std::string words;
  for (const Setting& one : settings_) {
    words += (words.empty() ? "" : " ") + std::string(one.row->path) + "=";
    if (param::is_secret(*one.row)) words += "secret";
    for (std::size_t i = 0; i < one.values.size() && !param::is_secret(*one.row); ++i)
      words += (i == 0 ? "" : ",") + element_text(*one.row, one.values[i]);
  }
  return words;
}

std::string value_text(const param::Row& row, const param::Parameters& parameters) {
  std::string text;
  for (std::size_t i = 0; i < row.elements; ++i)
    text += (i == 0 ? "" : " ") + element_text(row, param::is_secret(row) ? 0 : row.get(parameters, i));
  return text;
}

std::string settings_between(const param::Parameters& from, const param::Parameters& to) {
  std::string words;
  for (const param::Row& row : param::kTable) {
    std::string value = value_text(row, to);
    if (value == value_text(row, from)) continue;
    std::replace(value.begin(), value.end(), ' ', ',');
    words += (words.empty() ? "" : " ") + std::string(row.path) + "=" + value;
  }
  return words;
}

std::string json_value(const param::Row& row, const param::Parameters& parameters) {
  std::string value = value_text(row, parameters);
  for (std::size_t at = 0; (at = value.find(' ', at)) != std::string::npos; at += 2) value.replace(at, 1, ", ");
  return row.elements == 1 ? value : "[" + value + "]";
}

std::string parameters_json(const param::Parameters& parameters) {
  std::string json;
  for (const param::Row& row : param::kTable)
    json += (json.empty() ? "\"" : ", \"") + std::string(row.path) + "\": " + json_value(row, parameters);
  return "{" + json + "}";
}

std::vector<std::pair<std::string, std::string>> parameter_notes(const param::Parameters& parameters,
                                                                 const ParameterSettings& settings) {
  std::vector<std::pair<std::string, std::string>> notes{{"parameters", parameters_json(parameters)},
                                                         {"numbers", "\"" + changed_parameters(parameters) + "\""}};
  if (const std::string words = settings.words(); !words.empty()) notes.emplace_back("set", "\"" + words + "\"");
  return notes;
}

std::string changed_parameters(const param::Parameters& parameters) {
  std::string words;
  for (const param::Row& row : param::kTable) {
    const std::string value = value_text(row, parameters);
    if (value == value_text(row, param::Parameters{})) continue;
    words += (words.empty() ? "" : ", ") + std::string(row.path) + " " + value;
  }
  return words;
}

}  // namespace tetap::sim
