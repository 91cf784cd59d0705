foreach(part rig scene deployment viewer shipped_files)
  fivepipe_test(scene_${part}_test scene_${part}.cpp LINK fivepipe_scene GTest::gmock)
endforeach()
