// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <array>
#include <initializer_list>
#include <numeric>

#include "tenter/core/files.h"
#include "tenter/core/json_reader.h"
#include "tenter/core/toml_document.h"
#include "tenter/rig/register_map.h"

namespace tenter {
namespace {

using Range = JsonReader::Range;

constexpr int kSchemaVersion = 1;
constexpr int kLastRegister = 65535;
constexpr std::size_t kMaxFile_bytes = std::size_t{1} << 20;
constexpr std::size_t kMaxName = 64;
constexpr std::size_t kMaxEntries = 64;  // of commands, settings, choices
constexpr std::size_t kMaxBlocks = 4;
constexpr std::size_t kMaxCounts = 8;

template <class T>
struct Named {
  std::string_view name;
  T value;
};

constexpr std::array kTypes{
    Named<RegisterType>{"u16", RegisterType::kU16}, Named<RegisterType>{"i16", RegisterType::kI16},
    Named<RegisterType>{"u32", RegisterType::kU32}, Named<RegisterType>{"i32", RegisterType::kI32},
    Named<RegisterType>{"f32", RegisterType::kF32},
};

constexpr std::array kMeanings{
    Named<StatusMeaning>{"cell-error", StatusMeaning::kCellError},
    Named<StatusMeaning>{"converter-error", StatusMeaning::kConverterError},
    Named<StatusMeaning>{"over-range", StatusMeaning::kOverRange},
    Named<StatusMeaning>{"stable", StatusMeaning::kStable},
    Named<StatusMeaning>{"unstable", StatusMeaning::kUnstable},
    Named<StatusMeaning>{"near-zero", StatusMeaning::kNearZero},
    Named<StatusMeaning>{"net-mode", StatusMeaning::kNetMode},
};

constexpr std::array kWordOrders{Named<bool>{"high-first", true}, Named<bool>{"low-first", false}};

/// The value of that name in the table; the error lists the names.
template <class T, std::size_t N>
T choose(JsonReader& in, const std::string& key, const std::array<Named<T>, N>& table) {
  const std::string text = in.text(key, kMaxName);
  std::string known;
  for (const Named<T>& entry : table) {
    if (entry.name == text) return entry.value;
    known += (known.empty() ? "" : ", ") + std::string(entry.name);
  }
  in.fail(key, "\"" + text + "\" is not known", "one of: " + known);
  return table[0].value;
}

void onlyKeys(JsonReader& in, std::initializer_list<std::string_view> keys) {
  if (!in.json().is_object()) return;
  for (const auto& [key, value] : in.json().items()) {
    if (std::find(keys.begin(), keys.end(), key) == keys.end()) {
      in.fail(key, "is not a key of register maps here", "see docs/formats/register-map.md");
    }
  }
}

int readRegister(JsonReader& in) {
  return static_cast<int>(in.integer("register", 0, kLastRegister));
}

WeightField readField(JsonReader in) {
  onlyKeys(in, {"register", "type", "word_order", "negative_bit", "twos_complement"});
  WeightField field;
  field.address = readRegister(in);
  field.type = choose(in, "type", kTypes);
  const bool two_words = registerCount(field.type) == 2;
  if (two_words) field.high_word_first = choose(in, "word_order", kWordOrders);
  if (!two_words && in.has("word_order")) in.fail("word_order", "means nothing for one register");
  const bool is_unsigned = field.type == RegisterType::kU16 || field.type == RegisterType::kU32;
  if (in.has("negative_bit")) {
    if (!is_unsigned) in.fail("negative_bit", "belongs to an unsigned magnitude only");
    field.negative_bit = static_cast<int>(in.integer("negative_bit", 0, 15));
  }
  if (in.has("twos_complement")) {
    field.twos_complement = in.boolean("twos_complement");
    if (!field.negative_bit) in.fail("twos_complement", "belongs to a field with a negative_bit");
  }
  return field;
}

RegisterBits readBits(JsonReader& in) {
  RegisterBits bits;
  bits.address = readRegister(in);
  if (!in.has("bits")) return bits;
  const std::vector<int> range = in.integers("bits", 0, 15);
  if (range.size() != 2 || range[0] > range[1]) {
    in.fail("bits", "must be the lowest and the highest bit, such as [0, 7]");
    return bits;
  }
  bits.low_bit = range[0];
  bits.high_bit = range[1];
  return bits;
}

ScaleRule readScale(JsonReader in) {
  ScaleRule scale;
  if (in.has("value")) {
    onlyKeys(in, {"value"});
    scale.constant = in.number("value", Range::positive(1e9));
    return scale;
  }
  onlyKeys(in, {"register", "bits", "values"});
  scale.source = readBits(in);
  scale.choices = in.numbers("values", Range::positive(1e9));
  if (scale.choices.empty() || scale.choices.size() > kMaxEntries) {
    in.fail("values", "must have 1 to 64 numbers, one for each value of the bits from 0");
  }
  return scale;
}

void checkUnit(JsonReader& in, const std::string& key, const std::string& unit) {
  if (!newtonsPerUnit(unit)) {
    in.fail(key, "\"" + unit + "\" is no unit of force", "one of: N, mN, kN, g, kg, t, lb");
  }
}

UnitRule readUnit(JsonReader in) {
  UnitRule unit;
  if (in.has("value")) {
    onlyKeys(in, {"value"});
    unit.constant = in.text("value", kMaxName);
    if (in.ok()) checkUnit(in, "value", unit.constant);
    return unit;
  }
  onlyKeys(in, {"register", "bits", "values"});
  unit.source = readBits(in);
  unit.choices = in.texts("values");
  if (unit.choices.empty() || unit.choices.size() > kMaxEntries) {
    in.fail("values", "must have 1 to 64 texts, one for each value of the bits from 0");
  }
  for (std::size_t i = 0; i < unit.choices.size(); ++i) {
    const std::string place = "values[" + std::to_string(i) + "]";
    if (!unit.choices[i].empty()) checkUnit(in, place, unit.choices[i]);
  }
  return unit;
}

StatusRegister readStatus(JsonReader in) {
  onlyKeys(in, {"register", "bits"});
  StatusRegister status;
  status.address = readRegister(in);
  JsonReader bits = in.object("bits");
  if (!in.ok()) return status;
  for (const auto& [name, value] : bits.json().items()) {
    const auto meaning = std::find_if(kMeanings.begin(), kMeanings.end(),
                                      [&](const auto& entry) { return entry.name == name; });
    if (meaning == kMeanings.end()) {
      bits.fail(name, "is no meaning of a status bit", "see docs/formats/register-map.md");
      return status;
    }
    for (const int bit : bits.integers(name, 0, 15)) {
      StatusMeaning& place = status.bits[static_cast<std::size_t>(bit)];
      if (place != StatusMeaning::kNothing) bits.fail(name, "gives a bit a second meaning");
      place = meaning->value;
    }
  }
  return status;
}

void readBlocks(JsonReader& in, RegisterMap& map) {
  const std::size_t size = in.arraySize("block");
  if (in.ok() && (size == 0 || size > kMaxBlocks)) in.fail("block", "must be there 1 to 4 times");
  for (std::size_t i = 0; i < size && in.ok(); ++i) {
    JsonReader entry = in.element("block", i);
    onlyKeys(entry, {"first", "counts"});
    RegisterBlock block;
    block.first = static_cast<int>(entry.integer("first", 0, kLastRegister));
    block.counts = entry.integers("counts", 1, map.max_registers);
    if (entry.ok() && (block.counts.empty() || block.counts.size() > kMaxCounts)) {
      entry.fail("counts", "must have 1 to 8 numbers");
      return;
    }
    if (entry.ok() && block.first + *std::max_element(block.counts.begin(), block.counts.end()) >
                          kLastRegister + 1) {
      entry.fail("counts", "reaches beyond register 65535");
    }
    map.blocks.push_back(std::move(block));
  }
}

void readCommands(JsonReader& in, RegisterMap& map) {
  if (!in.has("command")) return;
  JsonReader list = in.object("command");
  if (in.ok() && list.json().size() > kMaxEntries) in.fail("command", "has more than 64 entries");
  if (!in.ok()) return;
  for (const auto& [name, value] : list.json().items()) {
    JsonReader entry = list.object(name);
    onlyKeys(entry, {"register", "values"});
    AmplifierCommand command;
    command.name = name;
    command.address = readRegister(entry);
    for (const int word : entry.integers("values", 0, 0xFFFF)) {
      command.words.push_back(static_cast<std::uint16_t>(word));
    }
    const std::size_t limit = map.write_function == 6 ? 1 : 16;
    if (entry.ok() && (command.words.empty() || command.words.size() > limit)) {
      entry.fail("values", "must have 1 to " + std::to_string(limit) + " numbers");
    }
    map.commands.push_back(std::move(command));
  }
}

void readSettings(JsonReader& in, RegisterMap& map) {
  if (!in.has("setting")) return;
  JsonReader list = in.object("setting");
  if (in.ok() && list.json().size() > kMaxEntries) in.fail("setting", "has more than 64 entries");
  if (!in.ok()) return;
  for (const auto& [name, value] : list.json().items()) {
    JsonReader entry = list.object(name);
    onlyKeys(entry, {"register", "bits", "meanings"});
    AmplifierSetting setting;
    setting.name = name;
    setting.bits = readBits(entry);
    if (entry.has("meanings")) setting.meanings = entry.texts("meanings");
    map.settings.push_back(std::move(setting));
  }
}

/// Whether every turn of some block reads `count` registers from `first`.
bool everyScanReads(const RegisterMap& map, int first, int count) {
  return std::any_of(map.blocks.begin(), map.blocks.end(), [&](const RegisterBlock& block) {
    const int shortest = *std::min_element(block.counts.begin(), block.counts.end());
    return first >= block.first && first + count <= block.first + shortest;
  });
}

/// Two requests in a row of one length, and a late answer to the first would pass for the second's.
bool neighboursDiffer(const RegisterMap& map) {
  std::uint64_t turns = 1;
  for (const RegisterBlock& block : map.blocks) {
    turns = std::lcm(turns, static_cast<std::uint64_t>(block.counts.size()));
  }
  const int blocks = static_cast<int>(map.blocks.size());
  int last = map.countInTurn(blocks - 1, turns - 1);
  for (std::uint64_t turn = 0; turn < turns; ++turn) {
    for (int block = 0; block < blocks; ++block) {
      const int count = map.countInTurn(block, turn);
      if (count == last) return false;
      last = count;
    }
  }
  return true;
}

void checkTogether(JsonReader& in, const RegisterMap& map) {
  if (!in.ok()) return;
  const auto needs = [&](const char* key, const WeightField& field) {
    if (everyScanReads(map, field.address, registerCount(field.type))) return;
    in.fail(key, "is not read in every scan", "let a block hold it with its smallest count");
  };
  needs("gross", map.gross);
  needs("net", map.net);
  if (map.tare) needs("tare", *map.tare);
  if (!everyScanReads(map, map.status.address, 1)) {
    in.fail("status", "is not read in every scan", "let a block hold it with its smallest count");
  }
  if (!neighboursDiffer(map)) {
    in.fail("block", "two requests in a row have the same length, so a late answer could pass",
            "give the blocks counts that differ from one request to the next");
  }
  if (map.tare && !(map.sum_tolerance > 0.0)) {
    in.fail("sum_tolerance", "is missing; gross = net + tare is checked with it");
  }
}

RegisterMap readAll(JsonReader& in) {
  onlyKeys(in, {"schema_version", "name", "read_function", "write_function", "max_registers",
                "turnaround_ms", "response_timeout_ms", "longest_latency_ms", "sum_tolerance",
                "block", "status", "gross", "net", "tare", "scale", "unit", "command", "setting"});
  in.integer("schema_version", kSchemaVersion, kSchemaVersion);
  RegisterMap map;
  map.name = in.text("name", kMaxName);
  map.read_function = static_cast<int>(in.integer("read_function", 3, 4));
  map.write_function = static_cast<int>(in.integer("write_function", 6, 16));
  if (map.write_function != 6 && map.write_function != 16) {
    in.fail("write_function", "must be 6 or 16");
  }
  map.max_registers = static_cast<int>(in.integer("max_registers", 1, 125));
  map.turnaround_ms = static_cast<int>(in.integer("turnaround_ms", 0, 1000));
  map.response_timeout_ms = static_cast<int>(in.integer("response_timeout_ms", 1, 10000));
  map.longest_latency_ms = static_cast<int>(in.integer("longest_latency_ms", 1, 60000));
  if (in.has("sum_tolerance")) map.sum_tolerance = in.number("sum_tolerance", Range::positive(1e6));
  readBlocks(in, map);
  map.status = readStatus(in.object("status"));
  map.gross = readField(in.object("gross"));
  map.net = readField(in.object("net"));
  if (in.has("tare")) map.tare = readField(in.object("tare"));
  map.scale = readScale(in.object("scale"));
  map.unit = readUnit(in.object("unit"));
  readCommands(in, map);
  readSettings(in, map);
  checkTogether(in, map);
  return map;
}

}  // namespace

Result<RegisterMap> readRegisterMap(const std::filesystem::path& file) {
  const Result<std::string> text = readFile(file, kMaxFile_bytes);
  if (!text) return text.error();
  return parseRegisterMap(*text, file.string());
}

Result<RegisterMap> parseRegisterMap(std::string_view toml, const std::string& file) {
  const Result<nlohmann::json> json = jsonOfToml(toml, file);
  if (!json) return json.error();
  JsonReader in(*json, file);
  RegisterMap map = readAll(in);
  if (!in.ok()) return in.error();
  return map;
}

}  // namespace tenter
