// The module fivepipe_step.so: reads STEP files by Open CASCADE.
#include <IFSelect_ReturnStatus.hxx>
#include <STEPControl_Reader.hxx>
#include <Standard_Failure.hxx>
#include <Standard_OutOfMemory.hxx>
#include <new>

#include "common/config/mesh/step_checks.h"
#include "common/config/mesh/step_faces.h"
#include "common/config/mesh/step_module.h"

namespace fivepipe::config {
namespace {

ImportedMesh read_step(const std::string& file, std::optional<double> unit_m) {
  const auto refused = [](std::string reason) { return ImportedMesh{{}, {}, std::move(reason)}; };
  STEPControl_Reader reader;
  if (reader.ReadFile(file.c_str()) != IFSelect_RetDone)
    return refused("the file is no complete STEP file (ISO 10303-21)");
  if (std::string why = why_wrong_shape(reader, unit_m); !why.empty()) return refused(why);
  reader.TransferRoots();
  if (std::string why = why_incomplete(reader); !why.empty()) return refused(why);
  return mesh_of_faces(reader.OneShape());
}

}  // namespace

extern "C" void fivepipe_read_step(const std::string& file, std::optional<double> unit_m,
                                   ImportedMesh& mesh) {
  try {
    mesh = read_step(file, unit_m);
  } catch (const Standard_OutOfMemory&) {
    throw std::bad_alloc();
  } catch (const Standard_Failure& failure) {
    mesh = {{},
            {},
            std::string("Open CASCADE fails: ") + failure.DynamicType()->Name() + ' ' +
                failure.GetMessageString()};
  }
}

}  // namespace fivepipe::config
