// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tenter/core/result.h"
#include "tenter/core/types.h"
#include "xml_tree.h"

namespace tenter {

/// A value of an OpenCV FileStorage: a matrix, or a list of numbers as one row. Texts and maps are
/// left out.
struct StoredValue {
  Eigen::MatrixXd numbers;
};
using Storage = std::map<std::string, StoredValue>;

/// The top level of a storage; a value that claims to be a matrix and is none is an error with the
/// key as its place. Matrices above 4096 numbers are left out: no calibration has such.
Result<Storage> storageFromXml(const XmlElement& root, const std::string& file);
Result<Storage> storageFromJson(std::string_view text, const std::string& file);
/// The part of YAML that OpenCV and ROS write: keys at the line's beginning, matrices as maps of
/// rows, cols, data below them, lists in brackets.
Result<Storage> storageFromYaml(std::string_view text, const std::string& file);

}  // namespace tenter
