foreach(part segmentation undistortion synthetic sources pipeline footage)
  fivepipe_test(capture_${part}_test capture_${part}.cpp LINK fivepipe_capture)
endforeach()
