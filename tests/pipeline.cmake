fivepipe_test(pipeline_test pipeline/pipeline.cpp pipeline/process.cpp
  LINK fivepipe_messages fivepipe_bus fivepipe_scene nlohmann_json::nlohmann_json opencv_core opencv_imgcodecs opencv_videoio)
target_include_directories(pipeline_test SYSTEM PRIVATE ${OpenCV_INCLUDE_DIRS})
add_dependencies(pipeline_test fivepipe capture_node recon_node sim_node render_node)
