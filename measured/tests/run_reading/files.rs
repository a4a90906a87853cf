//! Guards the sentences about files that are no tables, and how refusals travel.

use anhyst_measured::MeasuredRun;

use super::{HEADER, options, read_bytes};

#[test]
fn files_that_are_no_tables_say_what_they_look_like() {
    let refusal = |name: &str, bytes: &[u8]| read_bytes(name, bytes, &[]).map(|_| ()).expect_err("must be refused");
    assert!(refusal("run.csv", b" \n\n").contains("run.csv: is empty"));
    assert!(refusal("run.csv", b"PK\x03\x04abc").contains("Excel"));
    assert!(refusal("run.csv", b"\x89HDF\r\n").contains("HDF5"));
    assert!(refusal("run.csv", b"\xff\xfet\0i\0").contains("UTF-16"));
    assert!(refusal("run.csv", b"a,b\n1,\0\x01\x02").contains("binary"));
    assert!(refusal("run.parquet", b"nonsense").contains("does not begin with PAR1"));
    assert!(refusal("run.csv", b"PAR1 and no more").contains("is not a Parquet file that can be read"));
    assert!(refusal("run.csv", b"0,1,2\n3,4,5\n").contains("has no header"));
    let header_only = format!("{HEADER}\n");
    assert!(refusal("run.csv", header_only.as_bytes()).contains("0 of its 0 rows"));
    let missing = MeasuredRun::read("nowhere/run.csv".as_ref(), &options(&[]))
        .unwrap_err()
        .to_string();
    assert!(missing.contains("nowhere/run.csv cannot be read"), "{missing}");
}

/// The command line hands refusals on as boxed errors.
#[test]
fn refusals_can_be_boxed_and_sent() {
    fn boxed<T: std::error::Error + Send + Sync + 'static>() {}
    boxed::<anhyst_measured::MeasuredError>();
}
