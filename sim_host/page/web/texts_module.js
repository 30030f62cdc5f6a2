// SPDX-License-Identifier: Apache-2.0
// Indonesian for what the module says in English: its faults, and the sentences of its importer.
import { languageNow } from "./texts.js";

/** What a fault of the world does, by its name; in English the module itself has it. */
export const FAULTS_ID = {
  gnss_jump: "posisi GNSS meleset 100 m ke timur, angka akurasinya tidak berubah",
  gnss_ramp: "posisi GNSS bergeser ke utara 1 m/s",
  gnss_outage: "tidak ada pesan GNSS sama sekali",
  gnss_frozen: "GNSS mengulang posisi dan kecepatan terakhir dengan timestamp baru",
  gnss_wrong_height: "ketinggian GNSS 47 m terlalu tinggi (geoid dihitung dua kali)",
  slip_left: "roda kiri selip: tepi roda bergerak 1 m/s lebih cepat daripada robot",
  slip_right: "roda kanan selip: tepi roda bergerak 1 m/s lebih cepat daripada robot",
  wheel_stuck: "roda kiri terkunci dan terseret: hitungan encoder tidak berubah",
  encoder_dropout: "kontak encoder kanan putus-putus: hitungan hilang setiap 100 ms, berselang-seling",
  imu_stuck: "IMU mengulang sampel terakhir dengan timestamp baru",
  imu_clipping: "getaran 60 m/s² dan 12 rad/s mendorong IMU sampai batasnya (tercatat di kolom clip)",
  gyro_bias_step: "bias giroskop pada sumbu vertikal melompat 0,02 rad/s",
  landmark_wrong_id: "pengamatan membawa ID landmark lain (tetangga tertukar)",
  landmark_outlier: "separuh pengamatan meleset 2 sampai 6 m dan sampai 0,5 rad",
  stale_stamps: "timestamp semua sensor 400 ms lebih tua daripada datanya",
  future_stamps: "timestamp semua sensor 400 ms mendahului datanya",
  clock_jump: "jam bus (timestamp dan sync) melompat maju 3 s, lalu kembali",
  lost_frames: "setiap frame hilang dengan peluang 20 %",
  kidnapped: "robot dipindahkan 8 m lebih jauh di lintasannya, tidak terukur oleh roda dan IMU",
  gnss_far: "tanpa GNSS selama 211 s, lalu 105 posisi meleset 800 m ke barat dengan angka akurasi yang sama",
  wheel_spin: "roda kanan selip di permukaan licin: tepi roda bergerak 2 m/s lebih cepat daripada robot",
  vibration: "dudukan longgar menggetarkan IMU 20 m/s² dan 1 rad/s pada 97 Hz, di dalam rentang ukurnya",
  mag_disturbance: "baja di dekat jalur: tambahan 30 µT ke timur",
  moving_start: "tidak ada sensor yang mengirim data; bila dimulai pada waktu 0, pose awal juga tidak diberikan: start sambil bergerak",
  lidar_covered: "sesuatu menutupi LiDAR: scan datang, tanpa pantulan",
  lidar_glass: "semua dinding kaca: sinar laser hilang, atau kembali dari belakangnya",
  lidar_mirrored: "scan terbalik kiri-kanan: kiri menjadi kanan, seperti LiDAR terpasang terbalik",
  lidar_turned: "LiDAR berputar 90° berlawanan arah jarum jam di dudukannya",
  lidar_late: "timestamp scan 100 ms setelah sinar laser pertamanya",
  lorry: "truk tanpa ujung lewat 3 m di depan dengan 1,5 m/s dan memenuhi gambar",
  moving_features: "30 % fitur berada pada benda yang bergerak 6 m di depan dengan 1,5 m/s",
  tracks_swapped: "di setiap gambar kedua, fitur yang bersebelahan bertukar track",
  images_lost: "separuh gambar tidak datang, dan separuh sisanya kehilangan satu frame",
  images_late: "gambar datang 150 ms lebih lambat",
  images_mirrored: "kiri menjadi kanan di gambar",
  images_turned: "gambar berputar 90° searah jarum jam terhadap titik utamanya",
  focal_length: "panjang fokus 20 % lebih panjang daripada semestinya",
  image_stamps: "timestamp gambar 100 ms setelah eksposurnya",
};

/** Pieces of sentences, the longer ones first. */
export const PIECES_ID = [
  ["gyroscope rows with the time of the row before", "baris giroskop dengan waktu baris sebelumnya"],
  ["gyroscope rows without one before them", "baris giroskop tanpa baris sebelumnya"],
  ["gyroscope rows without an accelerometer's within 0.1 s", "baris giroskop tanpa baris akselerometer dalam 0,1 s"],
  ["IMU samples beyond the range of their signals", "sampel IMU di luar rentang sinyalnya"],
  ["without gravity this is no specific force, left out", "tanpa gravitasi ini bukan specific force, tidak dipakai"],
  ["no accelerometer beside it, left out", "tanpa akselerometer pendamping, tidak dipakai"],
  ["no gyroscope beside it, left out", "tanpa giroskop pendamping, tidak dipakai"],
  ["no column of a known name, left out", "tanpa kolom dengan nama yang dikenal, tidak dipakai"],
  ["the last line is cut off and left out", "baris terakhir terpotong dan tidak dipakai"],
  ["rows were out of order and are sorted", "baris tidak urut dan telah diurutkan"],
  ["not used beside", "tidak dipakai di samping"],
  ["not used:", "tidak dipakai:"],
  ["no CAN data frame in the log", "tidak ada frame data CAN di log ini"],
  ["no input frames of this id base in the log", "tidak ada frame masukan dengan id ini di log"],
  [" assumed]", " diasumsikan]"],
];

/** A sentence of the module in the language of the page, as far as it is known. */
export function ofModule(text) {
  return languageNow() === "id" ? PIECES_ID.reduce((said, [english, own]) => said.replaceAll(english, own), text) : text;
}
/** What a fault does: {name, what}. */
export const faultText = ({ name, what }) => (languageNow() === "id" ? FAULTS_ID[name] ?? what : what);
