// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <opencv2/core/utility.hpp>

namespace tenter {

/// How many threads OpenCV uses within a scope; by itself it takes all cores, and waits for them
/// where others use them.
class OpencvThreads {
 public:
  explicit OpencvThreads(int threads) : before_(cv::getNumThreads()) { cv::setNumThreads(threads); }
  ~OpencvThreads() { cv::setNumThreads(before_); }
  OpencvThreads(const OpencvThreads&) = delete;
  OpencvThreads& operator=(const OpencvThreads&) = delete;

 private:
  int before_;
};

}  // namespace tenter
