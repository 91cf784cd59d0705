// A deployment file with a valid rig and scene, in a temporary folder.
#pragma once
#include <map>
#include <string>
#include <vector>

#include "common/config/deployment.h"
#include "tests/support/scene_files.h"

namespace fivepipe::test {

class DeploymentFile : public SceneFiles {
 protected:
  DeploymentFile() {
    write("rig.yaml", kGoodRig);
    write("scene.yaml", kGoodScene);
  }
  config::Deployment load(const std::string& text,
                          const std::map<std::string, std::string>& settings = {}) {
    return config::load_deployment(write("deployment.yaml", text), settings);
  }
  std::vector<std::string> problems(const std::string& text,
                                    const std::map<std::string, std::string>& settings = {}) {
    return problems_of([&] { load(text, settings); });
  }
  // A deployment file with these nodes, of which the first is in line 7.
  static std::string with_nodes(const std::string& nodes) {
    return "name: small\nrig: rig.yaml\nscene: scene.yaml\nviewer:\n  path: [{eye_m: [0, -1, 0.5], "
           "target_m: [0, 0, 0.2]}]\nnodes:\n" +
           nodes;
  }
};

}  // namespace fivepipe::test
