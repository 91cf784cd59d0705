// Draws the composite of a frame: the virtual scene, the hull and the overlays.
#pragma once
#include <optional>
#include <span>
#include <string>

#include "common/config/deployment.h"
#include "render_node/overlays/overlay_painter.h"
#include "render_node/renderer.h"
#include "render_node/virtual_frames.h"

namespace fivepipe::render {

// Needs a current GL context from construction to destruction.
class FramePainter {
 public:
  // Throws as Renderer does. Draws an image with every shader that a frame may need, because OpenGL
  // drivers finish the compilation of a shader when they first draw with it. Otherwise the first
  // frame would wait for the compilation (0.4 s with llvmpipe in
  // RenderNode.DrawsItsFirstFrameAsFastAsTheNext), and capture_node would drop the next ones.
  FramePainter(const config::Deployment& deployment, const config::Viewer& viewer);

  // See Renderer::draw(). marks: of objects that overlaid() returns; ignored if the scene has no
  // overlays.
  void draw(std::span<const HullFrame> eyes, const VirtualFrame& virtual_frame,
            const HullFrame* light_hull);

  const Renderer& renderer() const { return renderer_; }
  // Returns the object of this name if the overlays show something of it, otherwise null.
  const OverlaidObject* overlaid(const std::string& object) const;

 private:
  void warm_up(const config::Deployment& deployment, const config::Viewer& viewer);

  Renderer renderer_;
  std::optional<OverlayPainter> overlays_;  // present if the scene has overlays
};

}  // namespace fivepipe::render
