// SPDX-License-Identifier: Apache-2.0
// Settings of a user over a robot's compiled parameters, on the host: files of `path = value` lines and single
// settings. They are checked against the table that compiled robots are checked against.
#pragma once

#include "sim_host/play/arguments.hpp"
#include "tetap/param/limits.hpp"

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace tetap::sim {

class ParameterSettings {
 public:
  ParameterSettings() = default;
  /// Takes each `--params FILE`, then each `--set PATH=VALUE` out of the command line. Throws UsageError with FILE:LINE
  /// for a file that cannot be read, an unknown path, a value that is none or out of its limits.
  explicit ParameterSettings(Arguments& arguments);

  /// Settings from the text of a file named `name`: `path = value` lines, `#` begins a comment, elements are parted by
  /// blanks or commas. Throws UsageError.
  void read(std::string_view text, const std::string& name);
  /// `setting` is PATH=VALUE. Throws UsageError.
  void set(std::string_view setting, const std::string& where);

  /// The parameters of a robot with all settings, the last of a path counting. Throws UsageError for a rule between
  /// fields that the result breaks.
  [[nodiscard]] param::Parameters over(param::Parameters parameters) const;
  /// The parameters with all settings, without a look at the rules between fields.
  [[nodiscard]] param::Parameters unchecked_over(param::Parameters parameters) const;
  /// First identifier of the node's block: as set, else the default.
  [[nodiscard]] std::uint32_t can_base() const { return unchecked_over({}).can_base; }
  /// `path=value`, one each, with blanks between; empty without a setting.
  [[nodiscard]] std::string words() const;

 private:
  struct Setting {
    std::string where;
    const param::Row* row;
    std::vector<double> values;
  };
  [[nodiscard]] std::string place_of(const param::Rule& rule) const;

  std::vector<Setting> settings_;
};

/// The lines on them in a program's help.
inline constexpr std::string_view kParameterHelp =
    "  --params FILE      parameters over the robot's own: `path = value` lines, # comments (tetap-params writes one)\n"
    "  --set PATH=VALUE   one parameter over the robot's own and the file's; may be given more than once\n";

/// Elements with blanks between; the shortest decimals that read back as the same bits.
[[nodiscard]] std::string value_text(const param::Row& row, const param::Parameters& parameters);

/// `PATH=VALUE` of each row that differs, with blanks between, as SET= takes them.
[[nodiscard]] std::string settings_between(const param::Parameters& from, const param::Parameters& to);

/// Value as JSON: a list where the row has elements.
[[nodiscard]] std::string json_value(const param::Row& row, const param::Parameters& parameters);

/// An object of every path and its value.
[[nodiscard]] std::string parameters_json(const param::Parameters& parameters);

/// Parameters in run.json: (name, JSON) of all values, of those that are not at their default, and of
/// the settings.
[[nodiscard]] std::vector<std::pair<std::string, std::string>> parameter_notes(const param::Parameters& parameters,
                                                                               const ParameterSettings& settings);

/// `path value` of every row that is not at its default, with commas between.
[[nodiscard]] std::string changed_parameters(const param::Parameters& parameters);

}  // namespace tetap::sim
