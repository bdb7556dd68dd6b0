// SPDX-License-Identifier: GPL-3.0-or-later
#include "tenter/calib/calibration_import.h"

#include "import_opencv.h"
#include "tenter/core/files.h"

namespace tenter {

namespace {

constexpr std::size_t kLimit_bytes = std::size_t{1} << 24;

/// First character that means something: byte order marks and white space do not.
char firstCharacter(std::string_view text) {
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
  const auto at = text.find_first_not_of(" \t\r\n");
  return at == std::string_view::npos ? '\0' : text[at];
}

}  // namespace

Result<CameraCalibration> importCalibrationTexts(
    const std::vector<std::pair<std::string, std::string>>& names_and_texts,
    const CalibrationImportOptions& options) {
  require(!names_and_texts.empty(), "something to import");
  Storage all;
  for (const auto& [file, text] : names_and_texts) {
    const char first = firstCharacter(text);
    Result<Storage> storage = Storage();
    if (first == '<') {
      const auto root = parseXml(text, file);
      if (!root) return root.error();
      if (root->name == "ParameterList") return calibrationFromDice(*root, file, options);
      if (root->name == "project") {
        return badInput(file, "", "is a project of Vic-3D, whose distortion model is not published",
                        "export the calibration in OpenCV's model");
      }
      if (root->name != "opencv_storage") {
        return badInput(file, root->name, "is no calibration of OpenCV or DICe");
      }
      storage = storageFromXml(*root, file);
    } else if (first == '{') {
      storage = storageFromJson(text, file);
    } else {
      storage = storageFromYaml(text, file);
    }
    if (!storage) return storage.error();
    all.merge(*storage);
  }
  return calibrationFromStorage(all, names_and_texts.front().first, options);
}

Result<CameraCalibration> importCalibration(const std::vector<std::filesystem::path>& files,
                                            const CalibrationImportOptions& options) {
  std::vector<std::pair<std::string, std::string>> texts;
  for (const std::filesystem::path& file : files) {
    auto text = readFile(file, kLimit_bytes);
    if (!text) return text.error();
    texts.emplace_back(file.string(), std::move(*text));
  }
  return importCalibrationTexts(texts, options);
}

}  // namespace tenter
