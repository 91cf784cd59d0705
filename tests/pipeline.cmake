if(FIVEPIPE_NODES)
  fivepipe_test(test_pipeline pipeline/pipeline_test.cpp pipeline/process.cpp
    LINK fivepipe_messages fivepipe_bus fivepipe_scene nlohmann_json::nlohmann_json opencv_core opencv_imgcodecs opencv_videoio)
  if(TARGET test_pipeline)
    target_include_directories(test_pipeline SYSTEM PRIVATE ${OpenCV_INCLUDE_DIRS})
    add_dependencies(test_pipeline fivepipe capture_node recon_node sim_node render_node)
  endif()
endif()
