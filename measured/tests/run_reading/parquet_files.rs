//! Guards that a Parquet file says the same as a text table, whatever its compression and types.

use std::sync::Arc;

use anhyst_measured::Quantity;
use parquet::basic::{Compression, ZstdLevel};
use parquet::data_type::{DoubleType, FloatType, Int64Type};
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::parser::parse_message_type;

use super::{good, read, read_bytes};

const SCHEMA: &str = "message run { required double time_s; required int64 counts; optional float displacement_um; }";

/// The good run with the command as a converter's counts; `absent` has no displacement.
fn file(compression: Compression, absent: Option<usize>) -> Vec<u8> {
    let run = read(&good(), &[]).unwrap();
    let of = |quantity: Quantity| run.series(quantity).unwrap();
    let counts: Vec<i64> = of(Quantity::FieldCommand)
        .iter()
        .map(|h| (h * 100.0).round() as i64)
        .collect();
    let micrometres: Vec<f32> = of(Quantity::Displacement).iter().map(|x| (x * 1e6) as f32).collect();
    let levels: Vec<i16> = (0..run.len()).map(|row| i16::from(Some(row) != absent)).collect();
    let present: Vec<f32> = (0..run.len())
        .filter(|row| Some(*row) != absent)
        .map(|row| micrometres[row])
        .collect();
    let schema = Arc::new(parse_message_type(SCHEMA).unwrap());
    let properties = WriterProperties::builder().set_compression(compression).build();
    let mut bytes = Vec::new();
    let mut writer = SerializedFileWriter::new(&mut bytes, schema, Arc::new(properties)).unwrap();
    let mut group = writer.next_row_group().unwrap();
    let mut column = group.next_column().unwrap().unwrap();
    column
        .typed::<DoubleType>()
        .write_batch(run.time_s.as_ref().unwrap(), None, None)
        .unwrap();
    column.close().unwrap();
    let mut column = group.next_column().unwrap().unwrap();
    column.typed::<Int64Type>().write_batch(&counts, None, None).unwrap();
    column.close().unwrap();
    let mut column = group.next_column().unwrap().unwrap();
    column
        .typed::<FloatType>()
        .write_batch(&present, Some(&levels), None)
        .unwrap();
    column.close().unwrap();
    group.close().unwrap();
    writer.close().unwrap();
    bytes
}

#[test]
fn every_compression_gives_the_same_run() {
    let zstd = Compression::ZSTD(ZstdLevel::try_new(3).unwrap());
    let gzip = Compression::GZIP(Default::default());
    let all = [
        Compression::UNCOMPRESSED,
        Compression::SNAPPY,
        zstd,
        gzip,
        Compression::LZ4_RAW,
    ];
    let csv = read(&good(), &[]).unwrap();
    for compression in all {
        // Read by what it holds, whatever it is called.
        let run = read_bytes("run.pq", &file(compression, None), &["command=counts*0.01"]).unwrap();
        assert_eq!((run.len(), run.lines.as_ref(), &run.time_s), (100, None, &csv.time_s));
        for quantity in [Quantity::FieldCommand, Quantity::Displacement] {
            let pairs = run.series(quantity).unwrap().iter().zip(csv.series(quantity).unwrap());
            let largest = pairs.map(|(one, other)| (one - other).abs()).fold(0.0, f64::max);
            let scale = if quantity == Quantity::Displacement { 4e-5 } else { 1e4 };
            assert!(largest < 1e-6 * scale, "{compression:?} {quantity:?}: {largest}");
        }
    }
}

#[test]
fn an_absent_cell_is_told_by_row_and_column() {
    let bytes = file(Compression::UNCOMPRESSED, Some(17));
    let refusal = read_bytes("run.parquet", &bytes, &["command=counts*0.01"]).unwrap_err();
    for part in [
        "run.parquet, row 17, column \"displacement_um\"",
        "\"\" is not a number",
        "--rows 18..",
    ] {
        assert!(refusal.contains(part), "\"{part}\" is missing in: {refusal}");
    }
}
