//! A statement as people type it: parsed, held to what can be answered, and put into the form that Polars answers.

use std::collections::BTreeSet;
use std::ops::ControlFlow;

use sqlparser::ast::{
    Expr, Join, JoinOperator, ObjectName, Query, Select, SetExpr, ShowStatementOptions, Statement, TableFactor, Visit,
    VisitMut, Visitor, VisitorMut,
};
use sqlparser::dialect::GenericDialect;
use sqlparser::parser::{Parser, ParserOptions};

use super::QueryError;
use super::rewrite::{column_beside_aggregates, rewrite};

/// What a statement asks for.
pub(super) enum Asked {
    /// Rows.
    Rows(Rows),
    /// The columns of a table.
    Columns { table: String },
    /// The names of all tables.
    Tables,
}

/// A statement for Polars.
#[derive(Default)]
pub(super) struct Rows {
    pub(super) sql: String,
    /// Every name that may be a table's.
    pub(super) relations: BTreeSet<String>,
    /// Whether elements of lists are asked for, as `x[1]` or by a function.
    pub(super) has_elements: bool,
    /// Whether every row of a table is paired with every row of another.
    pub(super) is_crossed: bool,
}

/// Reads a statement.
///
/// # Errors
///
/// When it is no statement, more than one, or one that cannot be answered.
pub(super) fn read(sql: &str) -> Result<Asked, QueryError> {
    // As Polars does.
    let options = ParserOptions { trailing_commas: true, ..ParserOptions::default() };
    let parser = Parser::new(&GenericDialect).with_options(options).try_with_sql(sql);
    let statements = parser.and_then(|mut parser| parser.parse_statements());
    let mut statements = statements.map_err(|error| QueryError::Syntax { words: error.to_string() })?;
    let mut statement = match (statements.pop(), statements.len()) {
        (Some(statement), 0) => statement,
        (None, _) => return Err(refused("an empty statement", "write SELECT columns FROM table")),
        _ => return Err(refused("more than one statement", "ask them one by one")),
    };
    match &statement {
        Statement::ExplainTable { table_name: table, .. } => return Ok(columns(table)),
        Statement::ShowColumns { show_options, .. } => return columns_shown(show_options),
        Statement::ShowTables { .. } => return Ok(Asked::Tables),
        Statement::Query(_) => {}
        Statement::Explain { statement, .. } if matches!(**statement, Statement::Query(_)) => {}
        other => return Err(changes(&other.to_string())),
    }
    let mut rows = Rows::default();
    if let ControlFlow::Break(error) = Visit::visit(&statement, &mut Check(&mut rows)) {
        return Err(*error);
    }
    let _: ControlFlow<()> = VisitMut::visit(&mut statement, &mut Rewrite);
    rows.sql = statement.to_string();
    Ok(Asked::Rows(rows))
}

fn columns(table: &ObjectName) -> Asked {
    Asked::Columns { table: last_name(table) }
}

/// `SHOW COLUMNS FROM table`.
fn columns_shown(options: &ShowStatementOptions) -> Result<Asked, QueryError> {
    let table = options.show_in.as_ref().and_then(|show_in| show_in.parent_name.as_ref());
    table.map(columns).ok_or_else(|| refused("SHOW COLUMNS without a table", "write DESCRIBE table"))
}

fn last_name(name: &ObjectName) -> String {
    name.0.last().and_then(|part| part.as_ident()).map(|ident| ident.value.clone()).unwrap_or_default()
}

fn refused(found: &str, instead: &str) -> QueryError {
    QueryError::NotAnswered { found: found.to_owned(), instead: instead.to_owned() }
}

fn changes(statement: &str) -> QueryError {
    let keyword = statement.split_whitespace().next().unwrap_or_default().to_uppercase();
    let instead = "tables are only read: write SELECT, DESCRIBE table or SHOW TABLES, and --csv, --json or --parquet FILE \
                   to keep an answer";
    refused(&keyword, instead)
}

/// Refuses what cannot be answered, and notes what an answer needs.
struct Check<'a>(&'a mut Rows);

impl Visitor for Check<'_> {
    type Break = Box<QueryError>;

    fn pre_visit_query(&mut self, query: &Query) -> ControlFlow<Self::Break> {
        self.0.is_crossed |= query.body.as_select().is_some_and(is_crossed);
        match body(&query.body) {
            Some(error) => ControlFlow::Break(Box::new(error)),
            None => ControlFlow::Continue(()),
        }
    }

    fn pre_visit_relation(&mut self, relation: &ObjectName) -> ControlFlow<Self::Break> {
        self.0.relations.insert(last_name(relation));
        ControlFlow::Continue(())
    }

    fn pre_visit_table_factor(&mut self, table: &TableFactor) -> ControlFlow<Self::Break> {
        let function = match table {
            TableFactor::Table { name, args: Some(_), .. } | TableFactor::Function { name, .. } => last_name(name),
            TableFactor::TableFunction { expr, .. } => expr.to_string(),
            _ => return ControlFlow::Continue(()),
        };
        let instead = "write the name of a table, which SHOW TABLES tells: other files are not read";
        ControlFlow::Break(Box::new(refused(&format!("{function}() in place of a table"), instead)))
    }

    fn pre_visit_expr(&mut self, expression: &Expr) -> ControlFlow<Self::Break> {
        match expression {
            Expr::CompoundFieldAccess { .. } => self.0.has_elements = true,
            Expr::Function(function) => {
                self.0.has_elements |= last_name(&function.name).to_lowercase().starts_with("array_");
            }
            Expr::Exists { negated, .. } => {
                let not = if *negated { "NOT " } else { "" };
                let instead = format!(
                    "write x {not}IN (SELECT y FROM table WHERE …), or join the tables and count: FROM a JOIN b ON a.x = b.y"
                );
                return ControlFlow::Break(Box::new(refused(&format!("{not}EXISTS"), &instead)));
            }
            Expr::Subquery(_) => {
                let instead = "ask for it by itself, or over a window: SELECT x FROM (SELECT x, AVG(x) OVER () AS mean \
                               FROM t) AS t WHERE x > mean";
                return ControlFlow::Break(Box::new(refused("a query in place of a value", instead)));
            }
            _ => {}
        }
        ControlFlow::Continue(())
    }
}

fn is_crossed(select: &Select) -> bool {
    let is_cross = |join: &Join| matches!(join.join_operator, JoinOperator::CrossJoin(_));
    select.from.len() > 1 || select.from.iter().any(|from| from.joins.iter().any(is_cross))
}

/// Why a body cannot be answered.
fn body(body: &SetExpr) -> Option<QueryError> {
    match body {
        SetExpr::Select(select) if select.projection.is_empty() => {
            Some(refused("SELECT without a column", "write SELECT *, or the columns that are wanted"))
        }
        SetExpr::Select(select) => {
            let changed = select.into.as_ref().map(|into| changes(&into.to_string()));
            changed.or_else(|| ungrouped(select))
        }
        SetExpr::SetOperation { left, right, .. } => self::body(left).or_else(|| self::body(right)),
        SetExpr::Query(_) | SetExpr::Values(_) | SetExpr::Table(_) => None,
        SetExpr::Insert(statement)
        | SetExpr::Update(statement)
        | SetExpr::Delete(statement)
        | SetExpr::Merge(statement) => Some(changes(&statement.to_string())),
    }
}

/// Why a select cannot be answered that has aggregates, no groups, and columns of single rows beside them.
fn ungrouped(select: &Select) -> Option<QueryError> {
    let column = column_beside_aggregates(select)?;
    let instead = format!("write GROUP BY {column}, or FIRST({column})");
    Some(refused(&format!("{column} beside an aggregate, which has no single row"), &instead))
}

/// Puts every query into the form that Polars answers, those within others first.
struct Rewrite;

impl VisitorMut for Rewrite {
    type Break = ();

    fn post_visit_query(&mut self, query: &mut Query) -> ControlFlow<()> {
        rewrite(query);
        ControlFlow::Continue(())
    }
}

#[cfg(test)]
mod tests {
    use super::{Asked, read};

    /// The statement that Polars is given.
    fn given(sql: &str) -> String {
        match read(sql).unwrap_or_else(|error| panic!("{sql}: {error}")) {
            Asked::Rows(rows) => rows.sql,
            Asked::Columns { .. } | Asked::Tables => panic!("{sql} asks for no rows"),
        }
    }

    #[test]
    fn columns_are_named_as_they_are_typed_and_no_two_alike() {
        assert_eq!(given("SELECT MIN(x), MAX(x) FROM t"), r#"SELECT MIN(x) AS "MIN(x)", MAX(x) AS "MAX(x)" FROM t"#);
        assert_eq!(given("SELECT x, a.x FROM a"), r#"SELECT x, a.x AS "a.x" FROM a"#);
        assert_eq!(given("SELECT a.x, y AS z FROM a"), r#"SELECT a.x AS "x", y AS z FROM a"#);
        assert_eq!(given("SELECT x + 1, x + 1 FROM t"), r#"SELECT x + 1 AS "x + 1", x + 1 AS "x + 1 (2)" FROM t"#);
        assert_eq!(given("SELECT * FROM t"), "SELECT * FROM t");
    }

    #[test]
    fn a_query_in_place_of_a_value_and_a_select_of_nothing_are_refused_with_what_to_write() {
        let refused = |sql: &str| read(sql).err().map(|error| error.to_string()).unwrap_or_default();
        assert!(refused("SELECT x FROM t WHERE x > (SELECT AVG(x) FROM t)").contains("OVER () AS mean"));
        assert!(refused("SELECT (SELECT COUNT(*) FROM t)").contains("OVER () AS mean"));
        assert!(refused("SELECT FROM t").contains("write SELECT *"));
        assert_eq!(refused("SELECT x FROM t WHERE x IN (SELECT y FROM u)"), "");
    }

    #[test]
    fn an_order_by_what_is_selected_is_an_order_by_its_name() {
        assert_eq!(
            given("SELECT p, COUNT(*) FROM t GROUP BY p ORDER BY count(*) DESC, p"),
            r#"SELECT p, COUNT(*) AS "COUNT(*)" FROM t GROUP BY p ORDER BY "COUNT(*)" DESC, p"#
        );
    }

    #[test]
    fn an_order_by_an_aggregate_that_is_not_selected_is_computed_aside() {
        assert_eq!(
            given("SELECT p FROM t GROUP BY p ORDER BY SUM(x) LIMIT 3"),
            r#"SELECT p FROM (SELECT p, SUM(x) AS "order 1" FROM t GROUP BY p) AS "grouped" ORDER BY "order 1" LIMIT 3"#
        );
    }

    #[test]
    fn groups_of_a_join_are_made_of_its_columns_under_plain_names() {
        assert_eq!(
            given(
                "SELECT a.p AS x, b.p AS y, COUNT(*) AS n FROM t a JOIN t b ON a.i = b.j GROUP BY a.p, b.p ORDER BY n"
            ),
            concat!(
                r#"SELECT "column 1" AS x, "column 2" AS y, COUNT(*) AS n FROM (SELECT a.p AS "column 1", b.p AS "#,
                r#""column 2" FROM t a JOIN t b ON a.i = b.j) AS "joined" GROUP BY "column 1", "column 2" ORDER BY n"#
            )
        );
    }
}
