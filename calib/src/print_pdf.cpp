// SPDX-License-Identifier: GPL-3.0-or-later
#include <zlib.h>

#include <cstdio>
#include <vector>

#include "tenter/calib/print_page.h"

namespace tenter {

namespace {

constexpr double kPointsPerMm = 72.0 / 25.4;
/// Of Helvetica's capital letters, in sizes of the font.
constexpr double kCapitalHeight = 0.718;

template <class... Values>
std::string text(const char* format, Values... values) {
  char buffer[256];
  std::snprintf(buffer, sizeof buffer, format, values...);
  return buffer;
}

std::string deflated(std::string_view bytes) {
  uLongf size = compressBound(static_cast<uLong>(bytes.size()));
  std::string out(size, '\0');
  const int status = compress2(reinterpret_cast<Bytef*>(out.data()), &size,
                               reinterpret_cast<const Bytef*>(bytes.data()),
                               static_cast<uLong>(bytes.size()), Z_BEST_COMPRESSION);
  require(status == Z_OK, "zlib compresses any bytes");
  out.resize(size);
  return out;
}

std::string escaped(const std::string& words) {
  std::string out;
  for (const char c : words) {
    if (c == '(' || c == ')' || c == '\\') out += '\\';
    out += c;
  }
  return out;
}

std::string stream(const std::string& entries, std::string_view bytes) {
  const std::string data = deflated(bytes);
  return "<< " + entries + " /Filter /FlateDecode /Length " + std::to_string(data.size()) +
         " >>\nstream\n" + data + "\nendstream";
}

/// Page content in millimetres; PDF counts y upwards.
std::string contentOf(const PrintPage& page) {
  std::string out = text("%.9f 0 0 %.9f 0 0 cm\n", kPointsPerMm, kPointsPerMm);
  const PrintPage::Picture& picture = page.picture;
  if (picture.image.width > 0) {
    out += text("q %.6f 0 0 %.6f %.6f %.6f cm /Picture Do Q\n", picture.width_mm, picture.height_mm,
                picture.x_mm, page.height_mm - picture.y_mm - picture.height_mm);
  }
  for (const PrintPage::Box& box : page.boxes) {
    out += text("%.4f g %.6f %.6f %.6f %.6f re f\n", box.grey / 255.0, box.x_mm,
                page.height_mm - box.y_mm - box.height_mm, box.width_mm, box.height_mm);
  }
  out += "0 g\n";
  for (const PrintPage::Text& line : page.texts) {
    out += text("BT /Words %.4f Tf %.4f %.4f Td (", line.height_mm / kCapitalHeight, line.x_mm,
                page.height_mm - line.y_mm) +
           escaped(line.text) + ") Tj ET\n";
  }
  return out;
}

}  // namespace

std::string pdfOf(const PrintPage& page) {
  const ByteImage& image = page.picture.image;
  const bool has_picture = image.width > 0;
  std::vector<std::string> objects = {
      "<< /Type /Catalog /Pages 2 0 R /ViewerPreferences << /PrintScaling /None >> >>",
      "<< /Type /Pages /Kids [3 0 R] /Count 1 >>",
      text("<< /Type /Page /Parent 2 0 R /MediaBox [0 0 %.4f %.4f] /Contents 4 0 R /Resources << "
           "/Font << /Words 5 0 R >>%s >> >>",
           kPointsPerMm * page.width_mm, kPointsPerMm * page.height_mm,
           has_picture ? " /XObject << /Picture 6 0 R >>" : ""),
      stream("", contentOf(page)),
      "<< /Type /Font /Subtype /Type1 /BaseFont /Helvetica /Encoding /WinAnsiEncoding >>"};
  if (has_picture) {
    const std::string_view bytes(reinterpret_cast<const char*>(image.pixels.data()),
                                 image.pixels.size());
    objects.push_back(stream(
        "/Type /XObject /Subtype /Image /Width " + std::to_string(image.width) + " /Height " +
            std::to_string(image.height) + " /ColorSpace /DeviceGray /BitsPerComponent 8",
        bytes));
  }
  std::string pdf = "%PDF-1.4\n% Tenter\n", table = "0000000000 65535 f \n";
  for (std::size_t i = 0; i < objects.size(); ++i) {
    table += text("%010zu 00000 n \n", pdf.size());
    pdf += std::to_string(i + 1) + " 0 obj\n" + objects[i] + "\nendobj\n";
  }
  const std::string count = std::to_string(objects.size() + 1);
  const std::string table_at = std::to_string(pdf.size());
  return pdf + "xref\n0 " + count + "\n" + table + "trailer\n<< /Size " + count +
         " /Root 1 0 R >>\nstartxref\n" + table_at + "\n%%EOF\n";
}

}  // namespace tenter
