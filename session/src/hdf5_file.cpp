// SPDX-License-Identifier: GPL-3.0-or-later
#include "hdf5_file.h"

#include <array>

namespace tenter {

namespace {

/// UTF-8 of any length.
Hdf5Id textType() {
  Hdf5Id type(H5Tcopy(H5T_C_S1), H5Tclose);
  H5Tset_size(type.get(), H5T_VARIABLE);
  H5Tset_cset(type.get(), H5T_CSET_UTF8);
  return type;
}

Hdf5Id scalarSpace() { return {H5Screate(H5S_SCALAR), H5Sclose}; }

Hdf5Id listSpace(std::size_t size) {
  const hsize_t dimension = size;
  return {H5Screate_simple(1, &dimension, nullptr), H5Sclose};
}

std::vector<const char*> pointers(const std::vector<std::string>& texts) {
  std::vector<const char*> out;
  out.reserve(texts.size());
  for (const std::string& text : texts) out.push_back(text.c_str());
  return out;
}

template <class Item>
Hdf5Id typeOf();
template <>
Hdf5Id typeOf<double>() {
  return {H5Tcopy(H5T_NATIVE_DOUBLE), H5Tclose};
}
template <>
Hdf5Id typeOf<std::int64_t>() {
  return {H5Tcopy(H5T_NATIVE_INT64), H5Tclose};
}
template <>
Hdf5Id typeOf<std::uint8_t>() {
  return {H5Tcopy(H5T_NATIVE_UINT8), H5Tclose};
}
template <>
Hdf5Id typeOf<std::string>() {
  return textType();
}

/// The items as H5Dwrite wants them; `keep` holds what they point to.
template <class Item>
const void* bufferOf(const std::vector<Item>& items, std::vector<const char*>& /*keep*/) {
  return items.data();
}
const void* bufferOf(const std::vector<std::string>& items, std::vector<const char*>& keep) {
  keep = pointers(items);
  return keep.data();
}

}  // namespace

bool Hdf5Id::reset() {
  const bool done = !valid() || close_(id_) >= 0;
  id_ = H5I_INVALID_HID;
  return done;
}

Hdf5File::Hdf5File(const std::filesystem::path& file) {
  H5Eget_auto2(H5E_DEFAULT, &old_handler_, &old_handler_data_);
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);  // It would print.
  file_ = Hdf5Id(H5Fcreate(file.c_str(), H5F_ACC_EXCL, H5P_DEFAULT, H5P_DEFAULT), H5Fclose);
  expect(file_.valid());
}

Hdf5File::~Hdf5File() {
  (void)file_.reset();
  H5Eset_auto2(H5E_DEFAULT, old_handler_, old_handler_data_);
}

bool Hdf5File::finish() {
  expect(ok_ && H5Fflush(id(), H5F_SCOPE_GLOBAL) >= 0);
  expect(file_.reset());
  return ok_;
}

void Hdf5File::group(const std::string& path, const std::string& nx_class) {
  if (!ok_) return;
  expect(Hdf5Id(H5Gcreate2(id(), path.c_str(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT), H5Gclose)
             .valid());
  attribute(path, "NX_class", nx_class);
}

void Hdf5File::writeAttribute(const std::string& path, const std::string& name, const Hdf5Id& space,
                              const void* value) {
  if (!ok_) return;
  const Hdf5Id type = textType();
  const Hdf5Id attribute(H5Acreate_by_name(id(), path.c_str(), name.c_str(), type.get(),
                                           space.get(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT),
                         H5Aclose);
  expect(attribute.valid() && H5Awrite(attribute.get(), type.get(), value) >= 0);
}

void Hdf5File::attribute(const std::string& path, const std::string& name,
                         const std::string& value) {
  const char* text = value.c_str();
  writeAttribute(path, name, scalarSpace(), &text);
}

void Hdf5File::attribute(const std::string& path, const std::string& name,
                         const std::vector<std::string>& values) {
  writeAttribute(path, name, listSpace(values.size()), pointers(values).data());
}

void Hdf5File::write(const Hdf5Id& type, const Hdf5Id& space, const std::string& path,
                     const void* value) {
  if (!ok_) return;
  const Hdf5Id dataset(H5Dcreate2(id(), path.c_str(), type.get(), space.get(), H5P_DEFAULT,
                                  H5P_DEFAULT, H5P_DEFAULT),
                       H5Dclose);
  expect(dataset.valid() &&
         H5Dwrite(dataset.get(), type.get(), H5S_ALL, H5S_ALL, H5P_DEFAULT, value) >= 0);
}

void Hdf5File::text(const std::string& path, const std::string& value) {
  const char* text = value.c_str();
  write(textType(), scalarSpace(), path, &text);
}

void Hdf5File::texts(const std::string& path, const std::vector<std::string>& values) {
  write(textType(), listSpace(values.size()), path, pointers(values).data());
}

void Hdf5File::number(const std::string& path, double value, const std::string& units) {
  write(typeOf<double>(), scalarSpace(), path, &value);
  attribute(path, "units", units);
}

void Hdf5File::link(const std::string& existing, const std::string& path) {
  if (!ok_) return;
  expect(H5Lcreate_hard(id(), existing.c_str(), id(), path.c_str(), H5P_DEFAULT, H5P_DEFAULT) >= 0);
}

template <class Item>
Hdf5Column<Item>::Hdf5Column(Hdf5File& file, const std::string& path, std::size_t width,
                             const std::string& units)
    : file_(file), width_(width) {
  if (!file_.ok()) return;
  const int rank = width == 0 ? 1 : 2;
  const std::array<hsize_t, 2> empty = {0, width}, largest = {H5S_UNLIMITED, width},
                               chunk = {kRows, width};
  const Hdf5Id type = typeOf<Item>();
  const Hdf5Id space(H5Screate_simple(rank, empty.data(), largest.data()), H5Sclose);
  const Hdf5Id creation(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
  H5Pset_chunk(creation.get(), rank, chunk.data());
  H5Pset_deflate(creation.get(), 4);
  dataset_ = Hdf5Id(H5Dcreate2(file_.id(), path.c_str(), type.get(), space.get(), H5P_DEFAULT,
                               creation.get(), H5P_DEFAULT),
                    H5Dclose);
  file_.expect(dataset_.valid());
  if (!units.empty()) file_.attribute(path, "units", units);
}

template <class Item>
void Hdf5Column<Item>::add(Item item) {
  items_.push_back(std::move(item));
  if (items_.size() >= kRows * std::max<std::size_t>(width_, 1)) flush();
}

template <class Item>
void Hdf5Column<Item>::flush() {
  const std::size_t rows = items_.size() / std::max<std::size_t>(width_, 1);
  if (!file_.ok() || rows == 0) return;
  const int rank = width_ == 0 ? 1 : 2;
  const std::array<hsize_t, 2> begin = {rows_, 0}, count = {rows, width_},
                               grown = {rows_ + rows, width_};
  bool done = H5Dset_extent(dataset_.get(), grown.data()) >= 0;
  const Hdf5Id place(H5Dget_space(dataset_.get()), H5Sclose);
  const Hdf5Id memory(H5Screate_simple(rank, count.data(), nullptr), H5Sclose);
  done = done && H5Sselect_hyperslab(place.get(), H5S_SELECT_SET, begin.data(), nullptr,
                                     count.data(), nullptr) >= 0;
  std::vector<const char*> keep;
  const void* buffer = bufferOf(items_, keep);
  done = done && H5Dwrite(dataset_.get(), typeOf<Item>().get(), memory.get(), place.get(),
                          H5P_DEFAULT, buffer) >= 0;
  file_.expect(done);
  rows_ += rows;
  items_.clear();
}

template class Hdf5Column<double>;
template class Hdf5Column<std::int64_t>;
template class Hdf5Column<std::uint8_t>;
template class Hdf5Column<std::string>;

}  // namespace tenter
