// SPDX-License-Identifier: GPL-3.0-or-later
#include "rig_snap.h"

#include <sys/mman.h>

#include <algorithm>
#include <filesystem>

#include "output_guard.h"
#include "rig_client.h"
#include "tenter/acquisition/frame_quality.h"
#include "tenter/core/files.h"

namespace tenter::app {

namespace {

using Json = nlohmann::json;
namespace fs = std::filesystem;

struct Options {
  const CLI::Option* socket = nullptr;
  std::string output;
};

void declare(CLI::App& command, Options& o) {
  o.socket = command.get_parent()->get_option("--socket");
  command.add_option("-o,--output", o.output, "Folder to be made for the images")->required();
}

/// The image of a row of the answer, from the memory that came with it.
Result<CameraImage> imageOf(const Json& row, const std::vector<FileDescriptor>& files) {
  CameraImage image;
  const auto index = row.value("descriptor", std::size_t{0});
  image.width_px = row.value("width_px", 0);
  image.height_px = row.value("height_px", 0);
  image.bits = row.value("bits", 8);
  const std::size_t size_bytes = static_cast<std::size_t>(std::max(0, image.width_px)) *
                                 static_cast<std::size_t>(std::max(0, image.height_px)) *
                                 static_cast<std::size_t>(image.bytesPerPixel());
  const Error wrong{ErrorKind::kHardware, "", "tenterd", "an image is not as the answer says", ""};
  if (index >= files.size() || size_bytes == 0 || files[index].size_bytes() < size_bytes) {
    return wrong;
  }
  void* memory = mmap(nullptr, size_bytes, PROT_READ, MAP_PRIVATE, files[index].number(), 0);
  if (memory == MAP_FAILED) return wrong;
  const auto* bytes = static_cast<const std::uint8_t*>(memory);
  image.pixels.assign(bytes, bytes + size_bytes);
  munmap(memory, size_bytes);
  return image;
}

Result<int> snap(const Options& o, Console& console) {
  return takeSnap(o.socket->as<std::string>(), o.output, console);
}

}  // namespace

Result<int> takeSnap(const std::string& socket, const std::string& output, Console& console) {
  if (auto free = checkNewFolder(output); !free) return free.error();
  const auto client = RigClient::connect(socket);
  if (!client) return client.error();
  const auto answer = (*client)->call("frames");
  if (!answer) return answer.error();
  const std::vector<FileDescriptor> files = (*client)->takeFiles();
  std::error_code failed;
  fs::create_directories(output, failed);
  if (failed) return badInput(output, "", failed.message());
  console.answer = *answer;
  bool complete = true;
  for (Json& row : console.answer["frames"]) {
    const std::string name = row.value("name", "");
    if (!row.contains("descriptor")) {
      complete = false;
      console.say(name + ": " + row.value("fault", ""));
      continue;
    }
    const auto image = imageOf(row, files);
    if (!image) return image.error();
    const auto png = encodePng(*image);
    if (!png) return png.error();
    const fs::path file = fs::path(output) / (name + ".png");
    if (auto done = writeFileAtomically(file, *png); !done) return done.error();
    row.erase("descriptor");
    row["file"] = file.string();
    console.say(file.string() + "  " + row.value("fault", ""));
  }
  if (complete) return kDone;
  return Error{ErrorKind::kHardware, "", "cameras", "not every camera gave an image", ""};
}

Verb rigSnap() {
  return {"snap", "What the cameras see now, as PNG",
          [](CLI::App& c, Action& a) { setUpCommand<Options>(c, a, declare, snap); }};
}

}  // namespace tenter::app
