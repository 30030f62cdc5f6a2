// SPDX-License-Identifier: Apache-2.0
// Indonesian for what the doctor says of one log (sim_host/doctor/*.cpp): in its sentences # stands for a number and @ for words.
import { decimal, languageNow } from "./texts.js";

/** [sentence of the doctor, in Indonesian with the places of its values]. */
export const DOCTOR_ID = [
  ["By its speed in turns the antenna lies # m to the left of the body's origin (sigma #) and # m ahead of it or behind; stated are # m and # m (# s).", "Menurut kecepatannya di tikungan, antena berada {0} m di kiri titik asal badan (sigma {1}) dan {2} m di depan atau di belakangnya; yang dinyatakan {3} m dan {4} m ({5} s)."],
  ["Measure the antenna's place. By the speeds gnss.antenna_y_b_m is # and gnss.antenna_x_b_m is 0.0.", "Ukur posisi antena. Menurut kecepatan, gnss.antenna_y_b_m adalah {0} dan gnss.antenna_x_b_m 0,0."],
  ["Measure the antenna's place. By the speeds gnss.antenna_y_b_m is # and gnss.antenna_x_b_m is # or #.", "Ukur posisi antena. Menurut kecepatan, gnss.antenna_y_b_m adalah {0} dan gnss.antenna_x_b_m {1} atau {2}."],
  ["Negate VelX, VelY and VelZ of In_Imu#Accel in the sender: gravity is +9.81 upwards.", "Balik tanda VelX, VelY, dan VelZ di In_Imu{0}Accel pada pengirim: gravitasi adalah +9,81 ke atas."],
  ["Negate @ of In_Imu#@ in the sender.", "Balik tanda {0} di In_Imu{1}{2} pada pengirim."],
  ["The mean specific force points down (cosine # to the stated up)", "Rata-rata specific force mengarah ke bawah (kosinus {0} terhadap arah atas yang dinyatakan)"],
  [", and yet the magnetic field turns with the gyroscope.", ", padahal medan magnet berputar searah dengan giroskop."],
  ["; no device shows whether the gyroscope is turned, too.", "; tidak ada perangkat yang menunjukkan apakah giroskop juga terbalik."],
  [", and yet these turn against an IMU that is upside down: ", ", padahal yang berikut berlawanan dengan IMU yang terbalik: "],
  ["The gyroscope's yaw rate goes against ", "Laju yaw giroskop berlawanan dengan "],
  ["The force ahead goes against the acceleration by @ (correlation #), the force to the left with the curves (#).", "Gaya ke depan berlawanan dengan percepatan menurut {0} (korelasi {1}), gaya ke kiri searah dengan tikungan ({2})."],
  ["The force ahead goes against the acceleration by @ (correlation #).", "Gaya ke depan berlawanan dengan percepatan menurut {0} (korelasi {1})."],
  ["The force to the left goes against speed times turn rate by @ (correlation #), the force ahead with the acceleration (#).", "Gaya ke kiri berlawanan dengan kecepatan kali laju putar menurut {0} (korelasi {1}), gaya ke depan searah dengan percepatan ({2})."],
  ["The magnetic field turns by # times the gyroscope about that axis (sigma #).", "Medan magnet berputar {0} kali giroskop pada sumbu itu (sigma {1})."],
  ["Gravity turns by # times the gyroscope about @ (sigma #).", "Gravitasi berputar {0} kali giroskop pada sumbu {1} (sigma {2})."],
  ["The magnetic field turns with the gyroscope.", "Medan magnet berputar searah dengan giroskop."],
  ["The accelerometer's @ follows the motion (correlation #).", "Sumbu {0} akselerometer mengikuti gerak (korelasi {1})."],
  ["By the images the robot turns # times as by the gyroscope (# % of the turns' variance, # pairs of images), and what is near is in their lower half.", "Menurut gambar, robot berputar {0} kali putaran giroskop ({1} % varians putaran, {2} pasang gambar), dan benda yang dekat berada di paruh bawahnya."],
  ["By the images the robot turns about an axis that is # deg from its up (# % of the turns' variance, # pairs of images).", "Menurut gambar, robot berputar pada sumbu yang {0} derajat dari arah atasnya ({1} % varians putaran, {2} pasang gambar)."],
  ["By the images the robot turns # times as by the gyroscope (# % of the turns' variance, # pairs of images): the focal length is # px where # px is stated.", "Menurut gambar, robot berputar {0} kali putaran giroskop ({1} % varians putaran, {2} pasang gambar): panjang fokusnya {3} px, yang dinyatakan {4} px."],
  ["The turns by the images fit those by the gyroscope # ms before the stamps (# % of their variance; at the stamps # %).", "Putaran menurut gambar cocok dengan giroskop {0} ms sebelum timestamp-nya ({1} % variansnya; pada timestamp {2} %)."],
  ["@ of @ kept one value for # s, in which the other axes moved in # samples.", "{0} di {1} tidak berubah selama {2} s, sedangkan sumbu lainnya bergerak pada {3} sampel."],
  ["Over # legs of 8 s the distance by the fixes fits the integral of GNSS velocity to # % with @, to # % as sent", "Pada {0} penggal 8 s, jarak menurut posisi GNSS cocok dengan integral kecepatan GNSS sampai {1} % dengan {2}, sampai {3} % seperti dikirim"],
  ["; the gyroscope turns as the velocity's course does", "; giroskop berputar searah dengan arah kecepatan"],
  ["; the gyroscope turns against the velocity's course", "; giroskop berputar melawan arah kecepatan"],
  ["The distance by the fixes is # times the integral of the GNSS velocity over # legs of 8 s.", "Jarak menurut posisi GNSS adalah {0} kali integral kecepatan GNSS pada {1} penggal 8 s."],
  ["The heights of the fixes go against Up of In_GnssVelU: correlation # over # legs of 8 s.", "Ketinggian posisi GNSS berlawanan dengan Up di In_GnssVelU: korelasi {0} pada {1} penggal 8 s."],
  ["Send upward as positive in In_GnssVelU.", "Kirim arah naik sebagai positif di In_GnssVelU."],
  ["The mean specific force is # m/s2 over # s, gravity is 9.81 m/s2: a factor of 9.8 too much.", "Rata-rata specific force {0} m/s2 selama {1} s, gravitasi 9,81 m/s2: 9,8 kali terlalu besar."],
  ["The mean specific force is # m/s2 over # s, gravity is 9.81 m/s2.", "Rata-rata specific force {0} m/s2 selama {1} s, gravitasi 9,81 m/s2."],
  ["Multiply the accelerometer's values by 9.80665 once only.", "Kalikan nilai akselerometer dengan 9,80665 satu kali saja."],
  ["A sample's velocity increment is # m/s on average, where gravity alone gives # m/s: a mean specific force of # m/s2.", "Inkremen kecepatan satu sampel rata-rata {0} m/s, padahal gravitasi saja memberi {1} m/s: rata-rata specific force {2} m/s2."],
  ["The median of the specific force is # m/s2 over # s, gravity is 9.81 m/s2.", "Median specific force {0} m/s2 selama {1} s, gravitasi 9,81 m/s2."],
  ["Multiply the accelerometer's values by #, or set the sensitivity that belongs to its full-scale range.", "Kalikan nilai akselerometer dengan {0}, atau atur sensitivitas sesuai rentang skala penuhnya."],
  ["The mean specific force in @ axes is (#, #, #) m/s2: it points down, # deg from where up is stated.", "Rata-rata specific force pada sumbu {0} adalah ({1}, {2}, {3}) m/s2: mengarah ke bawah, {4} derajat dari arah atas yang dinyatakan."],
  ["The mean specific force in @ axes is (#, #, #) m/s2: # deg from where up is stated.", "Rata-rata specific force pada sumbu {0} adalah ({1}, {2}, {3}) m/s2: {4} derajat dari arah atas yang dinyatakan."],
  ["The horizontal force follows acceleration and curves by GNSS as stated (# % of its variance over # s), and by the wheels as if they drove backwards (# %).", "Gaya horizontal mengikuti percepatan dan tikungan menurut GNSS seperti dinyatakan ({0} % variansnya selama {1} s), dan menurut roda seolah-olah roda berjalan mundur ({2} %)."],
  ["The horizontal force follows acceleration and curves by @ as an IMU @ (# % of its variance over # s; as stated: # %).", "Gaya horizontal mengikuti percepatan dan tikungan menurut {0} seperti IMU {1} ({2} % variansnya selama {3} s; seperti dinyatakan: {4} %)."],
  ["Wheels that count backwards look the same.", "Roda yang menghitung mundur tampak sama."],
  ["Set inertial.mounting_bs = # # # # # # # # #, or turn the sensor; tools/calibrate/calibrate_robot finds it more finely.", "Isi inertial.mounting_bs = {0} {1} {2} {3} {4} {5} {6} {7} {8}, atau putar sensornya; tools/calibrate/calibrate_robot menghitungnya lebih teliti."],
  ["The log has # frames of @ and # of @, which belongs to the same sample.", "Log ini memuat {0} frame {1} dan {2} frame {3}, yang termasuk sampel yang sama."],
  ["Of # frames of @ and as many of its partners, # whole samples come out: Seq or Stamp of the parts differ.", "Dari {0} frame {1} dan pasangannya hanya terbentuk {2} sampel utuh: Seq atau Stamp bagian-bagiannya berbeda."],
  ["Send all messages of a sample with one Seq and, for GNSS, one Stamp.", "Kirim semua pesan sebuah sampel dengan satu Seq dan, untuk GNSS, satu Stamp."],
  ["The GNSS velocity fits the wheels' speed # ms before its stamp (correlation #, # at the stamp; # samples, # changes of speed by 1 m/s).", "Kecepatan GNSS cocok dengan kecepatan roda {0} ms sebelum timestamp-nya (korelasi {1}, pada timestamp {2}; {3} sampel, {4} perubahan kecepatan 1 m/s)."],
  ["whether the receiver is late: that takes a GNSS velocity and wheels over # changes of speed by 1 m/s (# seen, # velocities)", "apakah receiver terlambat: untuk itu perlu kecepatan GNSS dan roda pada {0} perubahan kecepatan 1 m/s (terlihat {1}, {2} sampel kecepatan)"],
  ["Stamp fixes and velocities with the time for which they hold, # ms earlier, or set gnss.delay_us.", "Beri posisi dan kecepatan timestamp saat data itu berlaku, {0} ms lebih awal, atau isi gnss.delay_us."],
  ["The fixes lie # km from the robot's configured origin, with @ # km.", "Posisi GNSS berjarak {0} km dari titik asal di konfigurasi robot, dengan {1} {2} km."],
  ["The fixes lie at #, # deg, # km from the robot's configured origin; the map reaches 105 km.", "Posisi GNSS berada di {0}, {1} derajat, {2} km dari titik asal di konfigurasi robot; jangkauan peta 105 km."],
  ["Over # pairs of chords the distance by the fixes fits the path of wheels@ to # (RMS of angle and ratio) with @, to # as sent.", "Pada {0} pasang tali busur, jarak menurut posisi GNSS cocok dengan lintasan roda{1} sampai {2} (RMS sudut dan rasio) dengan {3}, sampai {4} seperti dikirim."],
  ["The fixes lie # times as far apart as the path of the wheels is long (median of # chords; half of them from # to #).", "Jarak antarposisi GNSS {0} kali panjang lintasan roda (median {1} tali busur; separuhnya dari {2} sampai {3})."],
  ["The robot turns by its scans against", "Putaran robot menurut scan berlawanan dengan"],
  ["The course by GNSS turns with the wheels (#).", "Arah menurut GNSS berputar searah dengan roda ({0})."],
  ["The course by GNSS turns against the wheels (#).", "Arah menurut GNSS berputar berlawanan dengan roda ({0})."],
  ["Negate First and Step of In_ScanHead and set lidar.yaw_rad to #.", "Balik tanda First dan Step di In_ScanHead dan isi lidar.yaw_rad dengan {0}."],
  ["While the wheels drive straight ahead, the scans move at # deg to the left (# pairs, # m).", "Ketika roda berjalan lurus, scan bergeser pada {0} derajat ke kiri ({1} pasang, {2} m)."],
  ["Set lidar.yaw_rad to # (# deg), or turn the scanner.", "Isi lidar.yaw_rad dengan {0} ({1} derajat), atau putar LiDAR-nya."],
  ["The turn between scans fits the @ # ms before their stamps (correlation #, # at the stamps; # pairs).", "Putaran antar-scan cocok dengan {0} {1} ms sebelum timestamp-nya (korelasi {2}, pada timestamp {3}; {4} pasang)."],
  ["Stamp In_ScanHead with the time of the first beam, or add # to lidar.delay_us.", "Beri In_ScanHead timestamp saat sinar laser pertama, atau tambahkan {0} ke lidar.delay_us."],
  ["Seq of @, instance #, runs in two chains: # of its # frames go on with the chain that is not the last frame's.", "Seq {0}, instance {1}, berjalan dalam dua urutan: {2} dari {3} frame melanjutkan urutan yang bukan milik frame terakhir."],
  ["Stop one of the two senders of @, or give the second device another Inst.", "Hentikan salah satu pengirim {0}, atau beri perangkat kedua Inst yang lain."],
  ["Multiply In_GnssVelEN and In_GnssVelU by # in the sender: they are in m/s.", "Kalikan In_GnssVelEN dan In_GnssVelU dengan {0} pada pengirim: satuannya m/s."],
  ["Multiply the radii of wheels.drive by # or divide counts_per_turn by it (In_BodySpeed: wheels.speed_scale).", "Kalikan jari-jari di wheels.drive dengan {0} atau bagi counts_per_turn dengan nilai itu (In_BodySpeed: wheels.speed_scale)."],
  ["Send Stamp and Interval of @ in microseconds, modulo 2^20.", "Kirim Stamp dan Interval {0} dalam mikrodetik, modulo 2^20."],
  ["The stamps of @ advance by @ of the time of arrival in # of # spans of 0.3 s and more.", "Stamp {0} maju {1} dari waktu tiba pada {2} dari {3} rentang 0,3 s atau lebih."],
  ["The intervals of @ cover # % of the time between its samples.", "Interval {0} mencakup {1} % dari waktu antara sampelnya."],
  ["The log has no In_Sync, and the stamps of all # devices are # ms from the time of @ (modulo 1049 ms; 0 to # ms are fused).", "Log ini tanpa In_Sync, dan timestamp semua {0} perangkat berselisih {1} ms dari waktu {2} (modulo 1049 ms; 0 sampai {3} ms masih dipakai)."],
  ["Samples of @ are # ms old on arrival by the clock of @ (modulo 1049 ms; 0 to # ms are fused).", "Sampel {0} berumur {1} ms saat tiba menurut jam {2} (modulo 1049 ms; 0 sampai {3} ms masih dipakai)."],
  ["Stamp @ by the clock that In_Sync distributes.", "Beri {0} timestamp dari jam yang disebarkan lewat In_Sync."],
  ["The age of the samples of @ drifts by # us a second: # ms over the log, with a scatter of # ms.", "Umur sampel {0} bergeser {1} us per detik: {2} ms sepanjang log, dengan sebaran {3} ms."],
  ["Multiply the right radius of wheels.drive by # or the left one by #; the speed by GNSS or a measured distance shows which (In_WheelSpeed: wheels.right_speed_scale).", "Kalikan jari-jari kanan di wheels.drive dengan {0} atau yang kiri dengan {1}; kecepatan GNSS atau jarak terukur menunjukkan yang mana (In_WheelSpeed: wheels.right_speed_scale)."],
  ["Multiply the right radius of wheels.drive by #: the left wheel fits the stated track.", "Kalikan jari-jari kanan di wheels.drive dengan {0}: roda kiri cocok dengan track width yang dinyatakan."],
  ["Multiply the left radius of wheels.drive by #: the right wheel fits the stated track.", "Kalikan jari-jari kiri di wheels.drive dengan {0}: roda kanan cocok dengan track width yang dinyatakan."],
  ["The gyroscope turns by # rad/s more than the wheels do, in proportion to their speed: a right wheel # times as large as stated, or a left one # times (# s, # % of the turn explained).", "Giroskop berputar {0} rad/s lebih banyak daripada roda, sebanding dengan kecepatannya: roda kanan {1} kali ukuran yang dinyatakan, atau roda kiri {2} kali ({3} s, {4} % putaran terjelaskan)."],
  ["The @ wheel stands still for # s while the other one turns.", "Roda {0} diam selama {1} s sementara roda lainnya berputar."],
  ["Check the plug, the channels and the sender of the @ wheel's encoder.", "Periksa konektor, kanal, dan pengirim encoder roda {0}."],
  ["The wheels turn the robot @ the gyroscope's yaw rate over # s (correlation #)", "Roda memutar robot {0} laju yaw giroskop selama {1} s (korelasi {2})"],
  [", and drive it backwards for # % of its way.", ", dan menggerakkannya mundur pada {0} % lintasannya."],
  ["Negate Forward and YawRate in the sender of In_BodySpeed.", "Balik tanda Forward dan YawRate pada pengirim In_BodySpeed."],
  ["Negate YawRate in the sender of In_BodySpeed, or swap the wheels behind it.", "Balik tanda YawRate pada pengirim In_BodySpeed, atau tukar roda di belakangnya."],
  ["Swap Left and Right in the sender of @, or the two plugs.", "Tukar Left dan Right pada pengirim {0}, atau kedua konektornya."],
  ["The yaw rate of the gyroscope follows the sum of the wheels (correlation # over # s), not their difference (#): the @ wheel counts backwards.", "Laju yaw giroskop mengikuti jumlah kedua roda (korelasi {0} selama {1} s), bukan selisihnya ({2}): roda {3} menghitung mundur."],
  ["Negate the @ wheel in the sender of @, or swap channels A and B of its encoder.", "Balik tanda roda {0} pada pengirim {1}, atau tukar kanal A dan B encoder-nya."],
  ["The gyroscope turns # times as fast as the wheels over the stated track (between # and #, over # s).", "Giroskop berputar {0} kali secepat roda dengan track width yang dinyatakan (antara {1} dan {2}, selama {3} s)."],
  ["The gyroscope turns # times as fast as @ over # s; # is the factor between @.", "Giroskop berputar {0} kali secepat {1} selama {2} s; {3} adalah faktor antara {4}."],
  ["Leave out the factor pi/180: the gyroscope is in radians already.", "Hilangkan faktor pi/180: giroskop sudah dalam radian."],
  ["That is @.", "Itu {0}."],
  ["The gyroscope turns # times as fast as @ (between # and #, over # s).", "Giroskop berputar {0} kali secepat {1} (antara {2} dan {3}, selama {4} s)."],
  ["Multiply the gyroscope's values by #, or set the sensitivity that belongs to its full-scale range.", "Kalikan nilai giroskop dengan {0}, atau atur sensitivitas sesuai rentang skala penuhnya."],
  ["Divide wheels.drive.track_m by # (In_BodySpeed: multiply wheels.yaw_rate_scale by it).", "Bagi wheels.drive.track_m dengan {0} (In_BodySpeed: kalikan wheels.yaw_rate_scale dengan nilai itu)."],
  ["The robot drives # times as fast by GNSS as by its wheels over # s.", "Menurut GNSS robot berjalan {0} kali secepat menurut rodanya selama {1} s."],
];

/** Words that stand for @. */
export const WORDS_ID = {
  left: "kiri", right: "kanan", GNSS: "GNSS", against: "melawan", "the wheels": "roda", wheels: "roda", gyroscope: "giroskop", "the gyroscope": "giroskop", "the magnetic field": "medan magnet", "the sideways force in curves": "gaya samping di tikungan",
  "the course of the GNSS velocity": "arah kecepatan GNSS", "the course of the fixes": "arah posisi GNSS", "latitude and longitude swapped": "lintang dan bujur ditukar",
  "the latitude's sign changed": "tanda lintang dibalik", "the longitude's sign changed": "tanda bujur dibalik", "East and North swapped": "East dan North ditukar", "East and North reversed": "East dan North dibalik",
  "East and North turned by 90 deg": "East dan North diputar 90 derajat", "with left for right": "yang kiri dan kanannya tertukar", "with forward for backward": "yang depan dan belakangnya tertukar",
  "with x and y exchanged": "yang x dan y-nya tertukar", "with x and y exchanged and reversed": "yang x dan y-nya tertukar dan terbalik", "the node's own timer": "timer milik node",
  "degrees and radians": "derajat dan radian", "radians and degrees": "radian dan derajat", "m/s divided by those of a knot": "m/s yang dibagi faktor knot", "ddmm.mmmm divided by 100": "ddmm.mmmm yang dibagi 100",
  "decimals of a degree taken for minutes": "desimal derajat yang dianggap menit", knots: "knot", "miles an hour": "mil per jam", "a thousandth": "seperseribu", "a millionth": "sepersejuta", "the log": "log",
};
/** Words with a number that stand for @. */
const FORMS_ID = [[/^by (-?[\d.]+) times$/, (_, n) => `${decimal(n)} kali`], [/^turned by (-?[\d.]+) deg about up$/, (_, n) => `yang diputar ${decimal(n)} derajat terhadap sumbu tegak`]];
const wordsInOwn = (words) => WORDS_ID[words] ?? FORMS_ID.reduce((said, [form, own]) => said.replace(form, own), words);

const NUMBER = "(-?(?:\\d+(?:\\.\\d+)?(?:e[-+]?\\d+)?|inf|nan))", WORDS = "([^;:]{1,90}?)";
const pattern = (sentence) => new RegExp(sentence.split(/([#@])/).map((part) => (part === "#" ? NUMBER : part === "@" ? WORDS : part.replace(/[.*+?^${}()|[\]\\]/g, "\\$&"))).join(""), "g");
let patterns = null;

/** Evidence or change of a finding in the language of the page: {text, own}, own: all of it is in that language. */
export function doctorText(text) {
  if (languageNow() !== "id") return { text, own: true };
  patterns ??= DOCTOR_ID.map(([sentence, words]) => [pattern(sentence), words]);
  let rest = text;
  const said = patterns.reduce((now, [form, words]) => {
    rest = rest.replace(form, "");
    return now.replace(form, (...found) => words.replace(/\{(\d)\}/g, (_, i) => decimal(wordsInOwn(found[Number(i) + 1]))));
  }, text);
  return { text: said, own: !/[a-z]/i.test(rest) };
}
