fivepipe_test(launch_restart_test launch_restart.cpp LINK fivepipe_supervisor)
fivepipe_test(launch_supervisor_test launch_supervisor.cpp LINK fivepipe_supervisor)
fivepipe_test(launch_report_test launch_report.cpp LINK fivepipe_report)
fivepipe_test(launch_benchmark_test launch_benchmark.cpp LINK fivepipe_benchmark)
fivepipe_test(launch_command_test launch_command.cpp)
fivepipe_test(launch_up_test launch_up.cpp LINK nlohmann_json::nlohmann_json)
add_dependencies(launch_command_test fivepipe fivepipe_maps)
add_dependencies(launch_up_test fivepipe)
# A program of one's own, as its user builds it.
if(FIVEPIPE_TESTS)
  add_test(NAME Example.SubscriberCompiles COMMAND ${CMAKE_CTEST_COMMAND}
    --build-and-test ${CMAKE_SOURCE_DIR}/docs/examples/subscriber ${CMAKE_BINARY_DIR}/example-subscriber --build-generator ${CMAKE_GENERATOR}
    --build-options -DFIVEPIPE_IDL=${CMAKE_SOURCE_DIR}/idl/fivepipe.idl -DCMAKE_BUILD_TYPE=Release)
endif()
