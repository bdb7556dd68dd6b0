// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/core/result.h"

namespace tenter {

std::string Error::message() const {
  std::string text = file;
  if (!place.empty()) text += text.empty() ? place : ": " + place;
  if (!reason.empty()) text += text.empty() ? reason : ": " + reason;
  if (!advice.empty()) text += " (" + advice + ")";
  return text;
}

Error Error::in(std::string file_name) const& {
  Error copy = *this;
  copy.file = std::move(file_name);
  return copy;
}

Error badInput(std::string file, std::string place, std::string reason, std::string advice) {
  return {ErrorKind::kBadInput, std::move(file), std::move(place), std::move(reason),
          std::move(advice)};
}

Error notConverged(std::string reason, std::string advice) {
  return {ErrorKind::kNotConverged, "", "", std::move(reason), std::move(advice)};
}

Error usageError(std::string reason, std::string advice) {
  return {ErrorKind::kUsage, "", "", std::move(reason), std::move(advice)};
}

}  // namespace tenter
