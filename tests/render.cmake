foreach(part tile_set virtual_frames surface composite golden outputs window)
  fivepipe_test(render_${part}_test render_${part}.cpp LINK fivepipe_render fivepipe_gl_context)
endforeach()
