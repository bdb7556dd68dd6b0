// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tenter/core/result.h"

namespace tenter {

enum class PlyType { kInt8, kUint8, kInt16, kUint16, kInt32, kUint32, kFloat32, kFloat64 };
enum class PlyEncoding { kAscii, kLittleEndian, kBigEndian };

struct PlyProperty {
  std::string name;
  PlyType type = PlyType::kFloat32;
  std::optional<PlyType> count_type;  ///< Of a list; a scalar has none.
};

struct PlyElement {
  std::string name;
  std::int64_t count = 0;
  std::vector<PlyProperty> properties;
};

struct PlyHeader {
  PlyEncoding encoding = PlyEncoding::kAscii;
  std::vector<PlyElement> elements;
};

/// Takes the header off the front of `content`.
Result<PlyHeader> takePlyHeader(std::string_view& content, const std::string& file);

/// The numbers behind a header, one after the other.
class PlySource {
 public:
  PlySource(std::string_view content, PlyEncoding encoding)
      : content_(content), encoding_(encoding) {}
  /// The next number, or nothing at the end or if it is no number.
  std::optional<double> next(PlyType type);

 private:
  std::string_view content_;
  PlyEncoding encoding_;
};

}  // namespace tenter
