// SPDX-License-Identifier: GPL-3.0-or-later
#include "served_cameras.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <spawn.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <iostream>
#include <sstream>

#include "tenter/twin/virtual_cameras.h"

namespace tenter::test {
namespace {

constexpr const char* kEnd = "# end of the table";

bool obey(VirtualCameras& cameras, const std::string& line) {
  std::istringstream in(line);
  std::string what;
  int camera = 0;
  double value = 0.0;
  in >> what >> camera >> value;
  if (what == "lose") {
    cameras.losePackets(camera, value);
  } else if (what == "unplug") {
    cameras.unplug(camera);
  } else if (what == "replug") {
    return cameras.replug(camera).ok();
  } else if (what == "freeze") {
    cameras.freeze(camera, value != 0.0);
  } else if (what == "overexpose") {
    cameras.overexpose(camera, value != 0.0);
  } else if (what == "defocus") {
    cameras.defocus(camera, value);
  } else {
    return what == "exchange" && cameras.exchange(camera, static_cast<int>(value)).ok();
  }
  return true;
}

}  // namespace

int serveCameras(int count, int width_px, int height_px) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  VirtualCamerasOptions options;
  options.count = count;
  options.width_px = width_px;
  options.height_px = height_px;
  options.source = std::make_shared<TestPatternSource>();
  const auto cameras = VirtualCameras::serve(options);
  if (!cameras) return 1;
  std::cout << (*cameras)->configuration() << kEnd << std::endl;
  std::string line;
  while (std::getline(std::cin, line)) {
    std::cout << (obey(**cameras, line) ? "ok" : "failed") << std::endl;
  }
  return 0;
}

ServedCameras::ServedCameras(int count, int width_px, int height_px) {
  std::array<int, 2> in{}, out{};
  if (pipe2(in.data(), O_CLOEXEC) != 0 || pipe2(out.data(), O_CLOEXEC) != 0) std::abort();
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, in[0], STDIN_FILENO);
  posix_spawn_file_actions_adddup2(&actions, out[1], STDOUT_FILENO);
  std::array<std::string, 5> words{"camera_tests", "--serve", std::to_string(count),
                                   std::to_string(width_px), std::to_string(height_px)};
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  posix_spawn(&pid_, "/proc/self/exe", &actions, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  close(in[0]);
  close(out[1]);
  to_ = in[1];
  from_ = out[0];
  while (!configuration_.ends_with(kEnd)) {
    char c = 0;
    if (read(from_, &c, 1) != 1) break;  // it ended, and section() will say so
    configuration_ += c;
  }
  configuration_.resize(configuration_.size() -
                        std::min(configuration_.size(), std::string(kEnd).size()));
  readLine();
}

ServedCameras::~ServedCameras() {
  close(to_);
  close(from_);
  kill(pid_, SIGKILL);
  waitpid(pid_, nullptr, 0);
}

std::string ServedCameras::readLine() {
  std::string line;
  char c = 0;
  while (read(from_, &c, 1) == 1 && c != '\n') line += c;
  return line;
}

CameraSection ServedCameras::section() const {
  auto section = parseCameraSection(configuration_, "served cameras");
  EXPECT_TRUE(section) << section.error().message();
  return section ? *section : CameraSection();
}

void ServedCameras::tell(const std::string& order) {
  const std::string line = order + "\n";
  ASSERT_EQ(write(to_, line.data(), line.size()), static_cast<ssize_t>(line.size()));
  ASSERT_EQ(readLine(), "ok") << order;
}

}  // namespace tenter::test
