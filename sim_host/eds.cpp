// SPDX-License-Identifier: Apache-2.0
#include "sim_host/eds.hpp"

#include "tetap/firmware/canopen/objects.hpp"
#include "tetap/param/limits.hpp"
#include "tetap/param/stored_row.hpp"

#include <array>
#include <charconv>
#include <cstdarg>
#include <cstdio>
#include <cstring>
#include <vector>

namespace tetap::sim {
namespace {

using namespace firmware::canopen;
using Kind = param::StoredRow::Kind;

enum Type : unsigned { kUnsigned8 = 5, kUnsigned16 = 6, kUnsigned32 = 7, kText = 9 };
enum ObjectType : unsigned { kVar = 7, kArray = 8, kRecord = 9 };

[[gnu::format(printf, 2, 3)]] void add(std::string& to, const char* format, ...) {
  std::array<char, 512> text{};
  va_list values;
  va_start(values, format);
  std::vsnprintf(text.data(), text.size(), format, values);
  va_end(values);
  to += text.data();
}

struct Entry {
  std::string section;
  std::string name;
  unsigned type;
  const char* access;
  std::string value;
  std::string limits;
};
void add(std::string& to, const Entry& e) {
  add(to, "\n[%s]\nParameterName=%s\nObjectType=0x%X\nDataType=0x%04X\nAccessType=%s\n%s", e.section.c_str(),
      e.name.c_str(), kVar, e.type, e.access, e.limits.c_str());
  if (!e.value.empty()) add(to, "DefaultValue=%s\n", e.value.c_str());
  to += "PDOMapping=0\n";
}
std::string section(unsigned index, int sub = -1) {
  std::string text;
  add(text, sub < 0 ? "%04X" : "%04Xsub%X", index, static_cast<unsigned>(sub));
  return text;
}
void add_head(std::string& to, unsigned index, const std::string& name, ObjectType type, std::size_t elements) {
  add(to, "\n[%04X]\nParameterName=%s\nObjectType=0x%X\nSubNumber=%zu\n", index, name.c_str(), type, elements + 1);
  add(to, {section(index, 0), "Highest sub-index supported", kUnsigned8, "const", std::to_string(elements), ""});
}

unsigned type_of(const param::StoredRow& row) {
  constexpr std::array<unsigned, 4> kTypes{0x08, 0x04, 0x07, 0x15};  // REAL32, INTEGER32, UNSIGNED32, INTEGER64
  return kTypes[static_cast<std::size_t>(row.kind)];
}
template <class Number>
std::string number_at(const param::Parameters& p, std::size_t offset) {
  Number value{};
  std::memcpy(&value, reinterpret_cast<const char*>(&p) + offset, sizeof value);
  std::array<char, 32> text{};
  return {text.data(), std::to_chars(text.data(), text.data() + text.size(), value).ptr};
}
std::string value_of(const param::StoredRow& row, std::size_t element, const param::Parameters& p) {
  const std::size_t word = row.offset + 4 * element;
  switch (row.kind) {
    case Kind::kFloat:
      return number_at<float>(p, word);
    case Kind::kSigned:
      return number_at<std::int32_t>(p, word);
    case Kind::kUnsigned:
      return number_at<std::uint32_t>(p, word);
    default:
      return number_at<std::int64_t>(p, row.offset + 8 * element);
  }
}
std::string limits_of(const param::StoredRow& row) {
  std::string text;
  if (row.kind == Kind::kSigned)
    add(text, "LowLimit=%d\nHighLimit=%d\n", static_cast<std::int32_t>(row.least), static_cast<std::int32_t>(row.most));
  if (row.kind == Kind::kUnsigned) add(text, "LowLimit=%u\nHighLimit=%u\n", row.least, row.most);
  return text;
}

void add_row(std::string& to, const param::Row& row, const param::StoredRow& stored, std::uint16_t set,
             const param::Parameters& p) {
  const unsigned index = set + row.index;
  const char* const access = set == kCompiledRows ? "const" : set == kActiveRows || stored.access ? "ro" : "rw";
  const std::string name = std::string(row.path) + (set == kActiveRows     ? " (active)"
                                                    : set == kCompiledRows ? " (compiled)"
                                                                           : "");
  if (set == kStagedRows)
    add(to, "\n; %s%s%s%s", row.unit, *row.unit == '\0' ? "" : ": ", row.text,
        row.effect == param::Effect::kRestart ? " A change needs a restart." : "");
  if (row.elements == 1)
    return add(to, {section(index), name, type_of(stored), access, value_of(stored, 0, p), limits_of(stored)});
  add_head(to, index, name, kArray, row.elements);
  for (std::size_t i = 0; i < row.elements; ++i)
    add(to, {section(index, static_cast<int>(i) + 1), name + " " + std::to_string(i + 1), type_of(stored), access,
             value_of(stored, i, p), limits_of(stored)});
}

void add_list(std::string& to, const char* name, const std::vector<unsigned>& objects) {
  add(to, "\n[%s]\nSupportedObjects=%zu\n", name, objects.size());
  for (std::size_t i = 0; i < objects.size(); ++i) add(to, "%zu=0x%04X\n", i + 1, objects[i]);
}

}  // namespace

std::string electronic_data_sheet(const std::string& robot, const param::Parameters& compiled) {
  std::string text = "[FileInfo]\nFileName=tetap.eds\nFileVersion=1\nFileRevision=0\nEDSVersion=4.0\n";
  add(text, "Description=tetap, robot %s: parameters by SDO\nCreatedBy=tetap-params --eds\n", robot.c_str());
  add(text, "\n[DeviceInfo]\nVendorName=none\nVendorNumber=0x0\nProductName=tetap\nProductNumber=0x%08X\n", kLayout);
  text += "RevisionNumber=0x0\nOrderCode=none\n";
  for (const int kbit : {10, 20, 50, 125, 250, 500, 800, 1000}) add(text, "BaudRate_%d=%d\n", kbit, kbit >= 125);
  text +=
      "SimpleBootUpMaster=0\nSimpleBootUpSlave=1\nGranularity=0\nDynamicChannelsSupported=0\nGroupMessaging=0\n"
      "NrOfRXPDO=0\nNrOfTXPDO=0\nLSS_Supported=0\n\n[DummyUsage]\n";
  for (int i = 1; i <= 7; ++i) add(text, "Dummy%04d=0\n", i);
  add(text,
      "\n[Comments]\nLines=3\nLine1=0x2000 + row: staged. 0x3000 + row: active. 0x4000 + row: compiled.\n"
      "Line2=What is read from 0x5F00:1 and written to it makes the staged set active.\n"
      "Line3=0x080, 0x580, 0x600 and 0x700 + node id lie outside of the 128 identifiers from 0x%03X on.\n",
      compiled.can_base);
  std::vector<unsigned> rows;
  for (const std::uint16_t set : {kStagedRows, kActiveRows, kCompiledRows})
    for (const param::Row& row : param::kTable)
      if (!param::is_secret(row)) rows.push_back(set + row.index);
  rows.push_back(kApply);
  add_list(text, "MandatoryObjects", {0x1000, 0x1001, 0x1018});
  add_list(text, "OptionalObjects", {0x1008, 0x1009, 0x100A, 0x1010, 0x1011, 0x1014, 0x1017});
  add_list(text, "ManufacturerObjects", rows);
  add(text, {"1000", "Device type", kUnsigned32, "const", "0x0", ""});
  add(text, {"1001", "Error register", kUnsigned8, "ro", "", ""});
  add(text, {"1008", "Manufacturer device name", kText, "const", "tetap", ""});
  add(text, {"1009", "Manufacturer hardware version", kText, "const", "", ""});
  add(text, {"100A", "Manufacturer software version", kText, "const", "", ""});
  add_head(text, 0x1010, "Store parameters", kArray, 1);
  add(text, {"1010sub1", "Save all parameters", kUnsigned32, "rw", "", ""});
  add_head(text, 0x1011, "Restore default parameters", kArray, 1);
  add(text, {"1011sub1", "Restore all default parameters", kUnsigned32, "rw", "", ""});
  add(text, {"1014", "COB-ID EMCY", kUnsigned32, "ro", "$NODEID+0x80", ""});
  add(text, {"1017", "Producer heartbeat time", kUnsigned16, "const", std::to_string(kHeartbeat_ms), ""});
  add_head(text, 0x1018, "Identity object", kRecord, 4);
  std::string layout;
  add(layout, "0x%08X", kLayout);
  add(text, {"1018sub1", "Vendor-ID", kUnsigned32, "ro", "0x0", ""});
  add(text, {"1018sub2", "Product code", kUnsigned32, "ro", layout, ""});
  add(text, {"1018sub3", "Revision number", kUnsigned32, "ro", "", ""});
  add(text, {"1018sub4", "Serial number", kUnsigned32, "ro", "0x0", ""});
  for (const std::uint16_t set : {kStagedRows, kActiveRows, kCompiledRows})
    for (std::size_t i = 0; i < param::kTable.size(); ++i)
      if (!param::is_secret(param::kTable[i])) add_row(text, param::kTable[i], param::kStoredRows[i], set, compiled);
  add_head(text, kApply, "Apply", kRecord, 4);
  add(text, {"5F00sub1", "CRC of the staged set; written, the set is applied", kUnsigned32, "rw", "", ""});
  add(text, {"5F00sub2", "CRC of the active set", kUnsigned32, "ro", "", ""});
  add(text, {"5F00sub3", "Rows that wait for a restart", kUnsigned32, "ro", "", ""});
  add(text, {"5F00sub4", "Words that are not as compiled", kUnsigned32, "ro", "", ""});
  return text;
}

}  // namespace tetap::sim
