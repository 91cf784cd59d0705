fivepipe_test(pipeline_test pipeline/pipeline.cpp pipeline/process.cpp
  LINK fivepipe_messages fivepipe_bus fivepipe_scene nlohmann_json::nlohmann_json opencv_core opencv_imgcodecs opencv_videoio)
target_include_directories(pipeline_test SYSTEM PRIVATE ${OpenCV_INCLUDE_DIRS})
add_dependencies(pipeline_test fivepipe capture_node recon_node sim_node render_node)

# Recordings made and replayed by the real programs.
if(FIVEPIPE_TESTS)
  add_library(fivepipe_recording_tests STATIC pipeline/process.cpp pipeline/recordings.cpp)
  target_link_libraries(fivepipe_recording_tests PUBLIC fivepipe_options fivepipe_recording fivepipe_bus fivepipe_scene nlohmann_json::nlohmann_json GTest::gtest)
  target_compile_definitions(fivepipe_recording_tests PUBLIC FIVEPIPE_SOURCE_DIR="${CMAKE_SOURCE_DIR}" FIVEPIPE_BINARY_DIR="${CMAKE_RUNTIME_OUTPUT_DIRECTORY}")
  add_dependencies(fivepipe_recording_tests fivepipe capture_node recon_node sim_node render_node)
endif()
foreach(test recording replay determinism kept_recording recording_conformance recording_long)
  fivepipe_test(pipeline_${test}_test pipeline/${test}.cpp LINK fivepipe_recording_tests nlohmann_json::nlohmann_json)
endforeach()
# The same for longer: a minute of four cameras; five runs at each rate.
foreach(test determinism recording_long)
  add_test(NAME Long_${test} COMMAND pipeline_${test}_test)
  set_tests_properties(Long_${test} PROPERTIES LABELS long TIMEOUT 400 ENVIRONMENT FIVEPIPE_LONG=1)
endforeach()
