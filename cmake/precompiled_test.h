// What the precompiled headers of the test programs hold beside those of the libraries.
#pragma once
#include "precompiled.h"

#include <gtest/gtest.h>

// Only Clang instantiates templates once, in the precompiled header; GCC does so in each source.
#ifdef __clang__
#include <nlohmann/json.hpp>

namespace fivepipe::precompiled {

inline void instantiate_json() {
  nlohmann::json json = nlohmann::json::parse("{}");
  std::ifstream file;
  json["key"] = nlohmann::json::parse(file);
  json["key"].get<double>();
  json["key"].get<std::string>();
  nlohmann::ordered_json ordered = nlohmann::ordered_json::parse(json.dump());
  ordered["equal"] = ordered == ordered;
  ordered.dump();
}
inline void instantiate_eigen() {
  const Eigen::Vector3d a(1, 2, 3), b = (a + a).cross(a - a / 2).normalized() * a.dot(a);
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.translate(a);
  pose = pose * pose.inverse();
  const Eigen::Matrix3d rotation = pose.linear().transpose() * (a - b).norm();
  const Eigen::Vector3d c = rotation * (pose * a);
  const Eigen::Vector2d d = c.head<2>() * 2 + b.head<2>() / 2;
  static_cast<void>(d);
}

}  // namespace fivepipe::precompiled
#endif
