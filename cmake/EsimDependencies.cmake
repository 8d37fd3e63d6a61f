# What the libraries are made of; also read by find_package(esim). Everything comes from Debian 12's packages:
# scripts/setup lists them.
find_package(Eigen3 3.4 REQUIRED NO_MODULE)
find_package(fmt 9 REQUIRED)
find_package(Threads REQUIRED)
find_package(TBB REQUIRED)
find_package(yaml-cpp 0.7 REQUIRED)
find_package(nlohmann_json 3.11 REQUIRED)
find_package(embree 3.13 REQUIRED)
find_package(assimp 5.2 REQUIRED)
find_package(OpenCVModules REQUIRED COMPONENTS core imgproc imgcodecs video)
find_package(FFmpegLibraries REQUIRED COMPONENTS avcodec avformat avutil swscale)
find_package(OpenEXR 3.1 REQUIRED CONFIG)
find_package(HDF5 REQUIRED COMPONENTS C)
