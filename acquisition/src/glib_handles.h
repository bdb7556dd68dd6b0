// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <arv.h>

#include <memory>
#include <string>

namespace tenter {

struct Unref {
  void operator()(void* object) const { g_object_unref(object); }
};
template <class T>
using GHandle = std::unique_ptr<T, Unref>;

/// The error slot of a call of GLib's kind; freed when it is left.
class GErrorSlot {
 public:
  GErrorSlot() = default;
  ~GErrorSlot() { g_clear_error(&error_); }
  GErrorSlot(const GErrorSlot&) = delete;
  GErrorSlot& operator=(const GErrorSlot&) = delete;

  GError** operator&() {  // NOLINT(google-runtime-operator): what a C call writes through
    g_clear_error(&error_);
    return &error_;
  }
  bool failed() const { return error_ != nullptr; }
  std::string message() const { return error_ != nullptr ? error_->message : "unknown error"; }

 private:
  GError* error_ = nullptr;
};

inline std::string textOf(const char* text) { return text != nullptr ? text : ""; }

}  // namespace tenter
