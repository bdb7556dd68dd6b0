// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <hdf5.h>

#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace tenter {

/// Owns an HDF5 identifier of any kind.
class Hdf5Id {
 public:
  using Close = herr_t (*)(hid_t);
  Hdf5Id() = default;
  Hdf5Id(hid_t id, Close close) : id_(id), close_(close) {}
  ~Hdf5Id() { (void)reset(); }
  Hdf5Id(Hdf5Id&& other) noexcept
      : id_(std::exchange(other.id_, H5I_INVALID_HID)), close_(other.close_) {}
  Hdf5Id& operator=(Hdf5Id&& other) noexcept {
    std::swap(id_, other.id_);
    std::swap(close_, other.close_);
    return *this;
  }
  Hdf5Id(const Hdf5Id&) = delete;
  Hdf5Id& operator=(const Hdf5Id&) = delete;
  hid_t get() const { return id_; }
  bool valid() const { return id_ >= 0; }
  /// False if closing failed, which is when HDF5 may notice a full disk.
  bool reset();

 private:
  hid_t id_ = H5I_INVALID_HID;
  Close close_ = nullptr;
};

/// An HDF5 file being written. The first failure is remembered and what follows does nothing, so
/// that a layout is written as a straight list and checked once, by finish(). Nothing is printed.
class Hdf5File {
 public:
  explicit Hdf5File(const std::filesystem::path& file);
  ~Hdf5File();
  Hdf5File(const Hdf5File&) = delete;
  Hdf5File& operator=(const Hdf5File&) = delete;

  /// A group with its NeXus class.
  void group(const std::string& path, const std::string& nx_class);
  /// Attributes of a group or of a dataset that is there.
  void attribute(const std::string& path, const std::string& name, const std::string& value);
  void attribute(const std::string& path, const std::string& name,
                 const std::vector<std::string>& values);
  /// Datasets of one value, and of a list of texts.
  void text(const std::string& path, const std::string& value);
  void texts(const std::string& path, const std::vector<std::string>& values);
  void number(const std::string& path, double value, const std::string& units);
  /// A second name for a dataset.
  void link(const std::string& existing, const std::string& path);

  /// Closes the file; false if anything failed since the beginning.
  bool finish();

  hid_t id() const { return file_.get(); }
  bool ok() const { return ok_; }
  /// Remembers a failure.
  void expect(bool done) { ok_ = ok_ && done; }

 private:
  void write(const Hdf5Id& type, const Hdf5Id& space, const std::string& path, const void* value);
  void writeAttribute(const std::string& path, const std::string& name, const Hdf5Id& space,
                      const void* value);
  H5E_auto2_t old_handler_ = nullptr;
  void* old_handler_data_ = nullptr;
  Hdf5Id file_;
  bool ok_ = true;
};

/// A dataset that grows by rows of `width` items (0: rows are single items), compressed. Item is
/// double, std::int64_t, std::uint8_t or std::string. Flush before finish().
template <class Item>
class Hdf5Column {
 public:
  /// `units` may be empty.
  Hdf5Column(Hdf5File& file, const std::string& path, std::size_t width, const std::string& units);
  void add(Item item);
  void flush();

 private:
  static constexpr std::size_t kRows = 4096;  ///< Of a chunk, and kept in memory.
  Hdf5File& file_;
  std::size_t width_;
  std::size_t rows_ = 0;  ///< Already in the file.
  std::vector<Item> items_;
  Hdf5Id dataset_;
};

}  // namespace tenter
