// SPDX-License-Identifier: GPL-3.0-or-later
#include <array>
#include <filesystem>

#include "board_options.h"
#include "output_guard.h"
#include "pattern_flat.h"
#include "tenter/calib/print_page.h"
#include "tenter/core/files.h"
#include "verbs.h"

namespace tenter::app {

namespace {

namespace fs = std::filesystem;

constexpr double kMmPerInch = 25.4;
/// What PDFs and PNGs of this program say near their beginning.
constexpr std::string_view kMaker = "Tenter";

struct OutputOptions {
  std::string paper = "a4", output;
  double dots_per_inch = 600.0;
};

void declareOutput(CLI::App& command, OutputOptions& o) {
  command
      .add_option("--paper", o.paper, "a4, a3, a2, a1, letter, tabloid, or fit: as large as needed")
      ->capture_default_str();
  command.add_option("--dpi", o.dots_per_inch, "Dots per inch of a PNG and of textures")
      ->capture_default_str()
      ->check(CLI::Range(50.0, 4800.0));
  command.add_option("-o,--output", o.output, "NAME.pdf, NAME.png, or NAME for both")->required();
}

/// The files that an output's name stands for.
std::vector<fs::path> filesOf(const std::string& output) {
  const std::string extension = fs::path(output).extension().string();
  if (extension == ".pdf" || extension == ".png") return {output};
  return {output + ".pdf", output + ".png"};
}

Result<void> checkOutputs(const OutputOptions& o) {
  for (const fs::path& file : filesOf(o.output)) {
    if (auto ok = checkOutputFile(file, kMaker); !ok) return ok;
  }
  return {};
}

Result<int> write(const PrintPage& page, const OutputOptions& o, Console& console) {
  auto& files = console.answer["files"] = nlohmann::json::array();
  for (const fs::path& file : filesOf(o.output)) {
    std::string bytes;
    if (file.extension() == ".pdf") {
      bytes = pdfOf(page);
    } else {
      const auto image = rasterOf(page, o.dots_per_inch / kMmPerInch);
      if (!image) return image.error();
      bytes = encodePng(*image, 1e3 * o.dots_per_inch / kMmPerInch);
    }
    if (auto done = writeFileAtomically(file, bytes); !done) return done.error();
    files.push_back(file.string());
    console.say(file.string());
  }
  console.answer["width_m"] = 1e-3 * page.width_mm;
  console.answer["height_m"] = 1e-3 * page.height_mm;
  console.say("Print at 100 %, without scaling, and measure the rulers on the paper.");
  return kDone;
}

struct BoardPrint {
  BoardOptions board;
  OutputOptions output;
};

void declareBoardPrint(CLI::App& command, BoardPrint& o) {
  declareBoard(command, o.board);
  declareOutput(command, o.output);
}

Result<int> printBoard(const BoardPrint& o, Console& console) {
  const auto board = o.board.board();
  if (!board) return board.error();
  const auto paper = paperByName(o.output.paper);
  if (!paper) return paper.error();
  if (auto ok = checkOutputs(o.output); !ok) return ok.error();
  const auto page = boardPage(*board, *paper);
  if (!page) return page.error();
  return write(*page, o.output, console);
}

struct TexturePrint {
  TextureOptions texture;
  OutputOptions output;
};

void declareTexturePrint(CLI::App& command, TexturePrint& o) {
  command.add_option("--width-mm", o.texture.width_mm, "Width of the texture")
      ->capture_default_str();
  command.add_option("--height-mm", o.texture.height_mm, "Height of the texture")
      ->capture_default_str();
  command
      .add_option("--feature-mm", o.texture.feature_mm,
                  "The finest dots are one to two of it across; three to five pixels are best")
      ->capture_default_str();
  command.add_option("--bands", o.texture.bands, "Octaves of noise")->capture_default_str();
  command.add_option("--seed", o.texture.seed, "Another seed, another texture")
      ->capture_default_str();
  declareOutput(command, o.output);
}

Result<int> printTexture(const TexturePrint& o, Console& console) {
  const auto paper = paperByName(o.output.paper);
  if (!paper) return paper.error();
  if (auto ok = checkOutputs(o.output); !ok) return ok.error();
  TextureOptions texture = o.texture;
  texture.dots_per_inch = o.output.dots_per_inch;
  const auto page = texturePage(texture, *paper);
  if (!page) return page.error();
  return write(*page, o.output, console);
}

}  // namespace

Verb patternVerb() {
  static const std::array kRows = {
      flatPattern(),
      Verb{"board", "A chessboard or ChArUco board to calibrate cameras with",
           [](CLI::App& c, Action& a) {
             setUpCommand<BoardPrint>(c, a, declareBoardPrint, printBoard);
           }},
      Verb{"texture", "Wavelet noise to print on cloth, for the cameras to follow",
           [](CLI::App& c, Action& a) {
             setUpCommand<TexturePrint>(c, a, declareTexturePrint, printTexture);
           }}};
  return {"pattern", "Boards and textures to print, and patterns to cut, at true scale",
          [](CLI::App& command, Action& action) {
            command.require_subcommand(1);
            addSubcommands(command, kRows, action);
          }};
}

}  // namespace tenter::app
