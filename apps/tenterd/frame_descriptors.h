// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

#include "tenter/acquisition/camera_bank.h"

namespace tenter::daemon {

/// A file descriptor that is closed with its owner.
class Descriptor {
 public:
  explicit Descriptor(int number) : number_(number) {}
  ~Descriptor();
  Descriptor(Descriptor&& other) noexcept : number_(std::exchange(other.number_, -1)) {}
  Descriptor& operator=(Descriptor&&) = delete;
  int number() const { return number_; }

 private:
  int number_;
};

/// Puts each image of a set into memory that can be handed to another program and changed by
/// nobody (memfd, sealed), and says in the same order what is in it; docs/rig-safety.md. Error:
/// the kernel gives no memory.
Result<nlohmann::json> shareFrames(const FrameSet& set, const CameraSection& section,
                                   std::vector<Descriptor>& descriptors);

}  // namespace tenter::daemon
