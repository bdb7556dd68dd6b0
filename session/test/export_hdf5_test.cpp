// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <hdf5.h>

#include <cmath>

#include "session_samples.h"
#include "tenter/session/session_export.h"
#include "tenter/test_support/temporary_folder.h"

namespace tenter {
namespace {

namespace fs = std::filesystem;
using session_samples::header;
using session_samples::sample;
using session_samples::timeOf;
using session_samples::writeSession;
using test_support::listFolder;
using test_support::slurp;
using test_support::TemporaryFolder;
using testing::ElementsAre;
using testing::HasSubstr;

/// Reads a file with the library's own calls, apart from the code under test.
class Reader {
 public:
  explicit Reader(const fs::path& file)
      : file_(H5Fopen(file.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT)) {
    if (file_ < 0) throw std::runtime_error("HDF5 cannot open the file");
  }
  ~Reader() { H5Fclose(file_); }
  Reader(const Reader&) = delete;
  Reader& operator=(const Reader&) = delete;

  std::vector<hsize_t> shape(const std::string& path) const {
    const hid_t dataset = open(path), space = H5Dget_space(dataset);
    std::vector<hsize_t> size(static_cast<std::size_t>(H5Sget_simple_extent_ndims(space)));
    H5Sget_simple_extent_dims(space, size.data(), nullptr);
    H5Sclose(space);
    H5Dclose(dataset);
    return size;
  }
  template <class Number>
  std::vector<Number> numbers(const std::string& path, hid_t type) const {
    std::size_t count = 1;
    for (const hsize_t n : shape(path)) count *= n;
    std::vector<Number> values(count);
    const hid_t dataset = open(path);
    if (H5Dread(dataset, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()) < 0) {
      throw std::runtime_error("cannot read " + path);
    }
    H5Dclose(dataset);
    return values;
  }
  std::vector<std::string> texts(const std::string& path) const {
    std::size_t count = 1;
    for (const hsize_t n : shape(path)) count *= n;
    const hid_t dataset = open(path);
    return readTexts(count, [&](hid_t type, char** texts) {
      H5Dread(dataset, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, texts);
      H5Dclose(dataset);
    });
  }
  std::string attribute(const std::string& path, const std::string& name) const {
    const hid_t attribute =
        H5Aopen_by_name(file_, path.c_str(), name.c_str(), H5P_DEFAULT, H5P_DEFAULT);
    if (attribute < 0) throw std::runtime_error(path + " has no attribute " + name);
    return readTexts(1, [&](hid_t type, char** texts) {
      H5Aread(attribute, type, texts);
      H5Aclose(attribute);
    })[0];
  }
  bool has(const std::string& path) const {
    return H5Lexists(file_, path.c_str(), H5P_DEFAULT) > 0;
  }

 private:
  hid_t open(const std::string& path) const {
    const hid_t dataset = H5Dopen2(file_, path.c_str(), H5P_DEFAULT);
    if (dataset < 0) throw std::runtime_error("no dataset " + path);
    return dataset;
  }
  template <class Read>
  static std::vector<std::string> readTexts(std::size_t count, Read read) {
    const hid_t type = H5Tcopy(H5T_C_S1);
    H5Tset_size(type, H5T_VARIABLE);
    H5Tset_cset(type, H5T_CSET_UTF8);
    std::vector<char*> raw(count, nullptr);
    read(type, raw.data());
    H5Tclose(type);
    std::vector<std::string> texts;
    for (char* text : raw) {
      texts.emplace_back(text == nullptr ? "" : text);
      H5free_memory(text);
    }
    return texts;
  }
  hid_t file_;
};

TEST(ExportHdf5Test, SaysWhatASessionIsInTheWordsOfNexus) {
  const TemporaryFolder folder;
  writeSession(folder / "s");
  const auto done = exportSessionToHdf5(folder / "s", folder / "out/s.h5");
  ASSERT_TRUE(done.ok()) << done.error().message();
  EXPECT_THAT(listFolder(folder / "out"), ElementsAre("s.h5"));
  const Reader in(folder / "out/s.h5");
  const std::vector<std::pair<const char*, const char*>> classes = {
      {"/", "NXroot"},
      {"/entry", "NXentry"},
      {"/entry/user", "NXuser"},
      {"/entry/sample", "NXsample"},
      {"/entry/instrument", "NXinstrument"},
      {"/entry/tensions", "NXdata"},
      {"/entry/positions", "NXdata"},
      {"/entry/frames", "NXcollection"},
      {"/entry/events", "NXcollection"},
      {"/entry/protocol", "NXnote"}};
  for (const auto& [path, nx_class] : classes) EXPECT_EQ(in.attribute(path, "NX_class"), nx_class);
  EXPECT_EQ(in.attribute("/", "default"), "entry");
  EXPECT_EQ(in.attribute("/entry", "default"), "tensions");
  EXPECT_EQ(in.attribute("/entry/tensions", "signal"), "tension");
  EXPECT_EQ(in.attribute("/entry/tensions/tension", "units"), "N");
  EXPECT_EQ(in.attribute("/entry/positions/position", "units"), "m");
  EXPECT_EQ(in.attribute("/entry/tensions/time", "units"), "ns");
  EXPECT_EQ(in.attribute("/entry/sample/areal_density", "units"), "kg/m^2");
  EXPECT_THAT(in.texts("/entry/user/name"), ElementsAre("Zoë"));
  EXPECT_THAT(in.texts("/entry/start_time"), ElementsAre(header().start_utc));
  EXPECT_THAT(in.texts("/entry/protocol/data"), ElementsAre(header().protocol_text));
  EXPECT_THAT(in.texts("/entry/session_json/data"), ElementsAre(slurp(folder / "s/session.json")));
  EXPECT_THAT(in.texts("/entry/tensions/cell"), ElementsAre("cell-0", "cell-1"));
}

TEST(ExportHdf5Test, HoldsEverySampleFrameAndEvent) {
  const TemporaryFolder folder;
  constexpr int kSamples = 9000;  // Several chunks.
  writeSession(folder / "s", kSamples);
  ASSERT_TRUE(exportSessionToHdf5(folder / "s", folder / "s.h5").ok());
  const Reader in(folder / "s.h5");
  const std::vector<hsize_t> expected = {kSamples + 2, 2};
  ASSERT_EQ(in.shape("/entry/tensions/tension"), expected);
  const auto tension = in.numbers<double>("/entry/tensions/tension", H5T_NATIVE_DOUBLE);
  const auto position = in.numbers<double>("/entry/positions/position", H5T_NATIVE_DOUBLE);
  const auto time = in.numbers<std::int64_t>("/entry/positions/time", H5T_NATIVE_INT64);
  const auto age = in.numbers<std::int64_t>("/entry/tensions/age", H5T_NATIVE_INT64);
  for (int i = 0; i < kSamples; i += 7) {
    const auto row = static_cast<std::size_t>(i);
    const SampleRecord record = sample(header(), i);
    ASSERT_EQ(time[row], timeOf(i));
    ASSERT_EQ(tension[2 * row + 1], *record.tensions[1].tension_N);
    ASSERT_EQ(position[2 * row], *record.positions_m[0]);
    ASSERT_EQ(age[2 * row], record.tensions[0].age_ns);
  }
  // The last sample lacks its last cell.
  EXPECT_TRUE(std::isnan(tension.back()));
  EXPECT_TRUE(std::isnan(position.back()));
  const auto status = in.numbers<std::uint8_t>("/entry/tensions/status", H5T_NATIVE_UINT8);
  EXPECT_EQ(status.back(), static_cast<std::uint8_t>(TensionStatus::kMissing));
  EXPECT_THAT(in.texts("/entry/frames/file"),
              ElementsAre("frames/000000-left.png", "frames/000000-right.png",
                          "frames/000001-left.png", "frames/000001-right.png"));
  EXPECT_THAT(in.texts("/entry/events/kind"),
              ElementsAre("session", "phase", "operator", "state", "fault", "decision", "session",
                          "bus-trace", "session"));
  EXPECT_THAT(in.texts("/entry/events/json")[5], HasSubstr("1.50e-3"));
}

TEST(ExportHdf5Test, ARigWithoutCellsHasNoTensions) {
  const TemporaryFolder folder;
  const SessionHeader h = header(1, 0);
  const auto writer = std::move(SessionWriter::create(folder / "s", h)).value();
  ASSERT_TRUE(writer->append(0, sample(h, 0)).ok());
  ASSERT_TRUE(exportSessionToHdf5(folder / "s", folder / "s.h5").ok());
  const Reader in(folder / "s.h5");
  EXPECT_FALSE(in.has("/entry/tensions"));
  EXPECT_EQ(in.attribute("/entry", "default"), "positions");
}

TEST(ExportHdf5Test, ReplacesWholeOrLeavesAlone) {
  const TemporaryFolder folder;
  writeSession(folder / "s");
  folder.write("s.h5", "older export");
  std::string journal = slurp(folder / "s/journal.jsonl");
  const std::string whole = journal;
  journal[journal.size() / 2] ^= 1;
  folder.write("s/journal.jsonl", journal);
  EXPECT_FALSE(exportSessionToHdf5(folder / "s", folder / "s.h5").ok());
  EXPECT_EQ(slurp(folder / "s.h5"), "older export");
  EXPECT_THAT(listFolder(folder.path()), ElementsAre("s", "s.h5"));
  folder.write("s/journal.jsonl", whole + "torn");
  EXPECT_TRUE(exportSessionToHdf5(folder / "s", folder / "s.h5").ok());
  EXPECT_TRUE(slurp(folder / "s.h5").starts_with("\x89HDF"));
  const auto impossible = exportSessionToHdf5(folder / "s", folder / "s.h5/below.h5");
  ASSERT_FALSE(impossible.ok());
}

TEST(SessionExportTest, FormatsAreFoundByName) {
  EXPECT_TRUE(findSessionExport("hdf5").ok());
  EXPECT_THAT(findSessionExport("matlab").error().message(), HasSubstr("hdf5"));
}

}  // namespace
}  // namespace tenter
