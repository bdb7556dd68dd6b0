// SPDX-License-Identifier: GPL-3.0-or-later
#include <utility>

#include "test_kinds.h"

namespace tenter {
namespace {

/// What a measurement must carry to be of a kind; the first that fits is taken.
struct TestKind {
  bool (*accepts)(const Measurement&);
  Result<std::unique_ptr<FitTest>> (*make)(std::shared_ptr<const Measurement>, const ClothModel&,
                                           const FitTestOptions&);
};

constexpr TestKind kKinds[] = {
    {[](const Measurement& m) { return m.tensile.has_value(); }, makeTensileTest},
    {[](const Measurement& m) { return m.cantilever.has_value(); }, makeCantileverTest},
    {[](const Measurement& m) { return m.rest.has_value(); }, makeClothTest},
};

}  // namespace

Result<std::unique_ptr<FitTest>> makeFitTest(const Measurement& measurement,
                                             const ClothModel& model,
                                             const FitTestOptions& options) {
  return makeFitTest(std::make_shared<const Measurement>(measurement), model, options);
}

Result<std::unique_ptr<FitTest>> makeFitTest(std::shared_ptr<const Measurement> measurement,
                                             const ClothModel& model,
                                             const FitTestOptions& options) {
  if (measurement->frames.empty())
    return badInput(measurement->name, "frames", "there are none", "a fit needs at least one");
  for (const TestKind& kind : kKinds)
    if (kind.accepts(*measurement)) return kind.make(std::move(measurement), model, options);
  return badInput(measurement->name, "protocol",
                  "'" + measurement->protocol +
                      "' carries neither a tracked cloth, nor a tensile strip, nor a cantilever");
}

}  // namespace tenter
