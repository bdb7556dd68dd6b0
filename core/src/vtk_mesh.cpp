// SPDX-License-Identifier: GPL-3.0-or-later
#include "vtk_mesh.h"

#include <vtkCellArray.h>
#include <vtkCellData.h>
#include <vtkCommand.h>
#include <vtkDataArray.h>
#include <vtkDoubleArray.h>
#include <vtkLogger.h>
#include <vtkNew.h>
#include <vtkObjectFactory.h>
#include <vtkOutputWindow.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkXMLPolyDataReader.h>
#include <vtkXMLPolyDataWriter.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <mutex>
#include <new>

#include "vtk_guard.h"

namespace tenter {

namespace {

constexpr int kMaxComponents = 9;

/// First complaint of VTK in this thread while a reader or writer of ours runs.
thread_local std::string* active_complaint = nullptr;

void noteComplaint(const char* text) {
  if (active_complaint->empty()) *active_complaint = text != nullptr ? text : "unknown error";
}

class ErrorCatcher : public vtkCommand {
 public:
  static ErrorCatcher* New() { return new ErrorCatcher; }
  void Execute(vtkObject* /*caller*/, unsigned long /*event*/, void* text) override {
    if (active_complaint != nullptr) noteComplaint(static_cast<const char*>(text));
  }
};

/// VTK's inner objects (arrays, decompressors) take no observer and would print; outside of our
/// calls this window behaves as VTK's own.
class CatchingWindow : public vtkOutputWindow {
 public:
  static CatchingWindow* New() {
    auto* window = new CatchingWindow;
    window->InitializeObjectBase();
    return window;
  }
  void DisplayText(const char* text) override {
    if (active_complaint == nullptr) {
      vtkOutputWindow::DisplayText(text);
    } else {
      noteComplaint(text);
    }
  }
};

class ComplaintScope {
 public:
  ComplaintScope() {
    static std::once_flag once;
    std::call_once(once, [] {
      const vtkNew<CatchingWindow> window;
      vtkOutputWindow::SetInstance(window);
      // VTK logs to the terminal before it asks any window; a program that wants the log adds its
      // own sink.
      vtkLogger::SetStderrVerbosity(vtkLogger::VERBOSITY_OFF);
    });
    active_complaint = &text_;
  }
  ~ComplaintScope() { active_complaint = nullptr; }
  ComplaintScope(const ComplaintScope&) = delete;
  ComplaintScope& operator=(const ComplaintScope&) = delete;

  bool failed() const { return !text_.empty(); }
  /// The last line of VTK's message without its address and source position.
  std::string summary() const {
    std::string text = text_;
    while (!text.empty() && std::isspace(static_cast<unsigned char>(text.back())) != 0) {
      text.pop_back();
    }
    if (const auto line = text.rfind('\n'); line != std::string::npos) text.erase(0, line + 1);
    if (const auto address = text.find("): "); address != std::string::npos) {
      text.erase(0, address + 3);
    }
    return text;
  }

 private:
  std::string text_;
};

Eigen::MatrixXd matrixOf(vtkDataArray& array) {
  Eigen::MatrixXd out(array.GetNumberOfComponents(), array.GetNumberOfTuples());
  for (vtkIdType i = 0; i < out.cols(); ++i) array.GetTuple(i, out.col(i).data());
  return out;
}

/// Numeric arrays of points or cells.
Result<void> readArrays(vtkDataSetAttributes& attributes, vtkIdType count, const std::string& kind,
                        const std::string& file, std::map<std::string, Eigen::MatrixXd>& out) {
  for (int i = 0; i < attributes.GetNumberOfArrays(); ++i) {
    vtkDataArray* array = attributes.GetArray(i);
    if (array == nullptr) continue;
    const std::string name = array->GetName() != nullptr ? array->GetName() : "";
    std::string place = kind;
    place.append(" array \"").append(name).append("\"");
    if (array->GetNumberOfTuples() != count) {
      return badInput(file, place,
                      "has " + std::to_string(array->GetNumberOfTuples()) + " entries instead of " +
                          std::to_string(count));
    }
    if (array->GetNumberOfComponents() > kMaxComponents) {
      return badInput(file, place, "has too many components");
    }
    Eigen::MatrixXd values = matrixOf(*array);
    if (!values.allFinite()) return badInput(file, place, "holds a number that is not finite");
    out[name] = std::move(values);
  }
  return {};
}

/// Offsets and ids straight from the file: VTK does not check them.
Result<void> checkCells(vtkCellArray& cells, vtkIdType points, const std::string& file) {
  vtkDataArray& offsets = *cells.GetOffsetsArray();
  vtkDataArray& ids = *cells.GetConnectivityArray();
  const vtkIdType count = offsets.GetNumberOfTuples() - 1;
  double previous = 0.0;
  for (vtkIdType c = 0; c <= count; ++c) {
    const double offset = offsets.GetTuple1(c);
    const bool too_small = c > 0 && offset < previous + 3.0;
    if (too_small || offset < 0.0 || offset > static_cast<double>(ids.GetNumberOfTuples())) {
      return badInput(file, "polygon " + std::to_string(std::max<vtkIdType>(c - 1, 0)),
                      "has fewer than three vertices or a wrong offset");
    }
    previous = offset;
  }
  for (vtkIdType i = 0; i < ids.GetNumberOfTuples(); ++i) {
    const double id = ids.GetTuple1(i);
    if (!(id >= 0.0) || !(id < static_cast<double>(points))) {
      return badInput(file, "connectivity entry " + std::to_string(i),
                      "names a vertex that the file does not have");
    }
  }
  return {};
}

/// Splits polygons as fans; `owner` says which polygon each triangle came from.
void splitPolygons(vtkCellArray& cells, std::vector<Triangle>& triangles,
                   std::vector<Eigen::Index>& owner) {
  vtkDataArray& offsets = *cells.GetOffsetsArray();
  vtkDataArray& ids = *cells.GetConnectivityArray();
  const auto id = [&ids](vtkIdType i) { return static_cast<int>(ids.GetTuple1(i)); };
  for (vtkIdType c = 0; c + 1 < offsets.GetNumberOfTuples(); ++c) {
    const auto begin = static_cast<vtkIdType>(offsets.GetTuple1(c));
    const auto end = static_cast<vtkIdType>(offsets.GetTuple1(c + 1));
    for (vtkIdType i = begin + 1; i + 1 < end; ++i) {
      triangles.push_back({id(begin), id(i), id(i + 1)});
      owner.push_back(c);
    }
  }
}

Result<MeshFile> meshOf(vtkPolyData& poly, const std::string& file) {
  const vtkIdType points = poly.GetNumberOfPoints();
  if (points == 0) return badInput(file, "Points", "the mesh has no vertices");
  if (poly.GetNumberOfPolys() == 0) {
    return badInput(file, "Polys", "the mesh has no polygons", "export triangles");
  }
  if (poly.GetNumberOfVerts() + poly.GetNumberOfLines() + poly.GetNumberOfStrips() > 0) {
    return badInput(file, "Piece", "holds points, lines or strips beside polygons",
                    "keep polygons alone");
  }
  MeshFile out;
  out.mesh.positions = matrixOf(*poly.GetPoints()->GetData());
  if (!out.mesh.positions.allFinite()) {
    return badInput(file, "Points", "holds a number that is not finite");
  }
  if (auto done = checkCells(*poly.GetPolys(), points, file); !done) return done.error();
  std::vector<Eigen::Index> owner;
  splitPolygons(*poly.GetPolys(), out.mesh.triangles, owner);
  if (auto done = readArrays(*poly.GetPointData(), points, "point", file, out.data.point); !done) {
    return done.error();
  }
  const vtkIdType polygons = poly.GetNumberOfPolys();
  if (auto done = readArrays(*poly.GetCellData(), polygons, "cell", file, out.data.cell); !done) {
    return done.error();
  }
  for (auto& [name, values] : out.data.cell) values = Eigen::MatrixXd(values(Eigen::all, owner));
  if (const auto uv = out.data.point.find("uv"); uv != out.data.point.end()) {
    if (uv->second.rows() != 2) {
      return badInput(file, "point array \"uv\"", "must have two components");
    }
    out.mesh.uv = uv->second;
    out.data.point.erase(uv);
  }
  return out;
}

void addArray(vtkDataSetAttributes& attributes, const std::string& name,
              const Eigen::MatrixXd& values) {
  const vtkNew<vtkDoubleArray> array;
  array->SetName(name.c_str());
  array->SetNumberOfComponents(static_cast<int>(values.rows()));
  array->SetNumberOfTuples(values.cols());
  for (vtkIdType i = 0; i < values.cols(); ++i) array->SetTuple(i, values.col(i).data());
  attributes.AddArray(array);
}

void fillPolyData(vtkPolyData& poly, const TriangleMesh& mesh, const MeshData& data) {
  const vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  points->SetNumberOfPoints(mesh.vertexCount());
  for (int v = 0; v < mesh.vertexCount(); ++v) {
    points->SetPoint(v, mesh.positions.col(v).data());
  }
  poly.SetPoints(points);
  const vtkNew<vtkCellArray> cells;
  cells->AllocateEstimate(static_cast<vtkIdType>(mesh.triangles.size()), 3);
  for (const Triangle& triangle : mesh.triangles) {
    cells->InsertNextCell({triangle[0], triangle[1], triangle[2]});
  }
  poly.SetPolys(cells);
  if (mesh.hasUv()) addArray(*poly.GetPointData(), "uv", mesh.uv);
  for (const auto& [name, values] : data.point) addArray(*poly.GetPointData(), name, values);
  for (const auto& [name, values] : data.cell) addArray(*poly.GetCellData(), name, values);
}

}  // namespace

Result<MeshFile> parseVtp(const std::string& content, const std::string& file) {
  if (auto done = checkVtkXml(content, file); !done) return done.error();
  ComplaintScope complaint;
  try {
    const vtkNew<vtkXMLPolyDataReader> reader;
    const vtkNew<ErrorCatcher> catcher;
    reader->AddObserver(vtkCommand::ErrorEvent, catcher);
    reader->SetReaderErrorObserver(catcher);
    reader->SetParserErrorObserver(catcher);
    reader->ReadFromInputStringOn();
    reader->SetInputString(content);
    reader->Update();
    if (complaint.failed() || reader->GetErrorCode() != 0 || reader->GetOutput() == nullptr) {
      return badInput(file, "VTP", "VTK cannot read it: " + complaint.summary(),
                      "the file may have been cut off; write it again");
    }
    return meshOf(*reader->GetOutput(), file);
  } catch (const std::bad_alloc&) {
    return badInput(file, "VTP", "announces more data than memory can hold");
  } catch (const std::exception& error) {
    return badInput(file, "VTP", std::string("is damaged: ") + error.what());
  }
}

Result<std::string> formatVtp(const TriangleMesh& mesh, const MeshData& data) {
  ComplaintScope complaint;
  const vtkNew<vtkPolyData> poly;
  fillPolyData(*poly, mesh, data);
  const vtkNew<vtkXMLPolyDataWriter> writer;
  const vtkNew<ErrorCatcher> catcher;
  writer->AddObserver(vtkCommand::ErrorEvent, catcher);
  writer->SetInputData(poly);
  writer->SetDataModeToBinary();
  writer->SetCompressorTypeToZLib();
  writer->WriteToOutputStringOn();
  if (writer->Write() != 1 || complaint.failed()) {
    return badInput("", "VTP", "VTK cannot write it: " + complaint.summary());
  }
  return writer->GetOutputString();
}

}  // namespace tenter
