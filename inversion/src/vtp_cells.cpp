// SPDX-License-Identifier: GPL-3.0-or-later
#include "vtp_cells.h"

#include <vtkCellArray.h>
#include <vtkCellData.h>
#include <vtkDoubleArray.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkXMLPolyDataWriter.h>

#include "tenter/core/files.h"

namespace tenter {
namespace {

vtkNew<vtkPoints> pointsOf(const Points3& points) {
  vtkNew<vtkPoints> out;
  out->SetDataTypeToDouble();
  for (Eigen::Index i = 0; i < points.cols(); ++i) out->InsertNextPoint(points.col(i).data());
  return out;
}

void addArrays(vtkDataSetAttributes* attributes, const VtpArrays& data) {
  for (const auto& [name, values] : data) {
    vtkNew<vtkDoubleArray> array;
    array->SetName(name.c_str());
    array->SetNumberOfComponents(static_cast<int>(values.rows()));
    array->SetNumberOfTuples(values.cols());
    std::copy(values.data(), values.data() + values.size(), array->GetPointer(0));
    attributes->AddArray(array);
  }
}

Result<void> write(const std::filesystem::path& file, vtkPolyData* surface) {
  vtkNew<vtkXMLPolyDataWriter> writer;
  writer->SetInputData(surface);
  writer->WriteToOutputStringOn();
  if (writer->Write() == 0) return badInput(file.string(), "", "could not be written");
  return writeFileAtomically(file, writer->GetOutputString());
}

}  // namespace

Result<void> writeVtpPoints(const std::filesystem::path& file, const Points3& points,
                            const VtpArrays& data) {
  vtkNew<vtkPolyData> surface;
  vtkNew<vtkCellArray> cells;
  for (vtkIdType i = 0; i < points.cols(); ++i) cells->InsertNextCell(1, &i);
  surface->SetPoints(pointsOf(points));
  surface->SetVerts(cells);
  addArrays(surface->GetPointData(), data);
  return write(file, surface);
}

Result<void> writeVtpLines(const std::filesystem::path& file, const Points3& points,
                           const std::vector<std::array<int, 2>>& lines, const VtpArrays& data) {
  vtkNew<vtkPolyData> surface;
  vtkNew<vtkCellArray> cells;
  for (const auto& line : lines) cells->InsertNextCell({line[0], line[1]});
  surface->SetPoints(pointsOf(points));
  surface->SetLines(cells);
  addArrays(surface->GetCellData(), data);
  return write(file, surface);
}

}  // namespace tenter
