set(driver_libraries idl_geometry JPEG::JPEG)
set(driver_test_libraries opencv_core opencv_imgproc opencv_imgcodecs rapidcheck)
