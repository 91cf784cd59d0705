#include "common/config/mesh/step_checks.h"

#include <Interface_Check.hxx>
#include <Interface_CheckIterator.hxx>
#include <STEPConstruct_UnitContext.hxx>
#include <StepData_StepModel.hxx>
#include <StepGeom_CartesianTransformationOperator3d.hxx>
#include <StepGeom_Direction.hxx>
#include <StepGeom_GeomRepContextAndGlobUnitAssCtxAndGlobUncertaintyAssCtx.hxx>
#include <StepGeom_GeometricRepresentationContextAndGlobalUnitAssignedContext.hxx>
#include <StepGeom_Surface.hxx>
#include <StepRepr_GlobalUnitAssignedContext.hxx>
#include <StepShape_SolidModel.hxx>
#include <StepShape_TopologicalRepresentationItem.hxx>
#include <XSControl_TransferReader.hxx>
#include <XSControl_WorkSession.hxx>
#include <cmath>
#include <gp_XYZ.hxx>
#include <set>
#include <sstream>

#include "common/config/mesh/step_faces.h"

namespace fivepipe::config {
namespace {

// Relative; conversion factors and scales are decimal texts.
constexpr double kSameFactor = 1e-6;

using Entity = Handle(Standard_Transient);
using Units = Handle(StepRepr_GlobalUnitAssignedContext);

// Returns the units that an entity assigns to representations, or null.
Units units_of(const Entity& entity) {
  using WithAccuracy = StepGeom_GeomRepContextAndGlobUnitAssCtxAndGlobUncertaintyAssCtx;
  using WithoutAccuracy = StepGeom_GeometricRepresentationContextAndGlobalUnitAssignedContext;
  if (const auto both = Handle(WithAccuracy)::DownCast(entity); !both.IsNull())
    return both->GlobalUnitAssignedContext();
  if (const auto both = Handle(WithoutAccuracy)::DownCast(entity); !both.IsNull())
    return both->GlobalUnitAssignedContext();
  return Units::DownCast(entity);
}

std::string why_wrong_unit(const std::set<double>& units_mm, std::optional<double> unit_m) {
  if (units_mm.empty())
    return "the file states no unit of length: export it from a CAD program, which writes one";
  if (!unit_m) return "";
  const double stated_mm = *unit_m / kOcctUnit_m;
  for (const double unit_mm : units_mm)
    if (!(std::abs(unit_mm - stated_mm) <= kSameFactor * stated_mm)) {
      std::ostringstream text;
      text << "the file's unit is " << unit_mm << " mm, not " << stated_mm
           << " mm: leave the unit out, because a STEP file states it";
      return text.str();
    }
  return "";
}

// A damaged direction may have fewer than two ratios.
gp_XYZ vector_of(const Handle(StepGeom_Direction) & direction) {
  const auto ratio = [&](int i) {
    return i <= direction->NbDirectionRatios() ? direction->DirectionRatiosValue(i) : 0;
  };
  return {ratio(1), ratio(2), ratio(3)};
}

// Without an axis, STEP takes one that makes the placement right-handed.
bool scales_or_mirrors(const StepGeom_CartesianTransformationOperator3d& placement) {
  if (placement.HasScale() && !(std::abs(placement.Scale() - 1) <= kSameFactor)) return true;
  if (!placement.HasAxis1() || !placement.HasAxis2() || !placement.HasAxis3()) return false;
  return vector_of(placement.Axis1())
             .DotCross(vector_of(placement.Axis2()), vector_of(placement.Axis3())) < 0;
}

// Returns the first failure at an entity that belongs to the shape, or an empty text. Colours and
// dimensions do not.
std::string failure_of_shape(Interface_CheckIterator checks, const StepData_StepModel& model) {
  for (checks.Start(); checks.More(); checks.Next()) {
    const Handle(Interface_Check)& check = checks.Value();
    if (check->NbFails() == 0 || checks.Number() < 1 || checks.Number() > model.NbEntities())
      continue;
    const Entity& entity = model.Value(checks.Number());
    if (entity->IsKind(STANDARD_TYPE(StepShape_TopologicalRepresentationItem)) ||
        entity->IsKind(STANDARD_TYPE(StepShape_SolidModel)) ||
        entity->IsKind(STANDARD_TYPE(StepGeom_Surface)))
      return check->CFail(1);
  }
  return "";
}

// Returns the first failure of the conversion, or an empty text.
std::string failure_of_transfer(Interface_CheckIterator checks) {
  for (checks.Start(); checks.More(); checks.Next())
    if (checks.Value()->NbFails() > 0) return checks.Value()->CFail(1);
  return "";
}

}  // namespace

std::string why_wrong_shape(const STEPControl_Reader& loaded, std::optional<double> unit_m) {
  const StepData_StepModel& model = *loaded.StepModel();
  std::set<double> units_mm;
  for (int i = 1; i <= model.NbEntities(); ++i) {
    const Entity entity = model.Value(i);
    if (const Units units = units_of(entity); !units.IsNull()) {
      STEPConstruct_UnitContext context;
      context.ComputeFactors(units);
      if (context.LengthDone()) units_mm.insert(context.LengthFactor());
    }
    const auto placement = Handle(StepGeom_CartesianTransformationOperator3d)::DownCast(entity);
    if (!placement.IsNull() && scales_or_mirrors(*placement))
      return "the placement of a part scales or mirrors it, which Open CASCADE ignores: export the "
             "part in its size and form";
  }
  return why_wrong_unit(units_mm, unit_m);
}

std::string why_incomplete(const STEPControl_Reader& converted) {
  std::string failure = failure_of_shape(converted.WS()->ModelCheckList(), *converted.StepModel());
  if (failure.empty())
    failure = failure_of_transfer(converted.WS()->TransferReader()->LastCheckList());
  failure.erase(0, failure.find_first_not_of(' '));
  return failure.empty() ? ""
                         : "a part of the shape is damaged (Open CASCADE: " + failure +
                               "): repair it in the CAD program and export it again";
}

}  // namespace fivepipe::config
